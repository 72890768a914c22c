// The triangles of a points pack, read from their records.

// Ten words each.
@group(1) @binding(0) var<storage, read> triangles: array<u32>;
@group(1) @binding(1) var<storage, read> cells: array<Cell>;
// Three words for each triangle, if there are vertex colours.
@group(1) @binding(4) var<storage, read> colors: array<u32>;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) normal: vec3f,
    @location(2) tint: vec4f,
    // Shares of the sun and of the sky that are seen.
    @location(3) seen: vec2f,
    // Number of the triangle, material, and cell.
    @location(4) @interpolate(flat) what: vec3u,
    // From the eye.
    @location(5) place: vec3f,
}

// Half a word of a triangle record.
fn half_word(triangle: u32, n: u32) -> u32 {
    return (triangles[triangle * 10u + (n >> 1u)] >> ((n & 1u) * 16u)) & 0xffffu;
}

// Corner number `index` of the array, in a cell.
fn corner(index: u32, cell_index: u32) -> Corner {
    let triangle = index / 3u;
    let first = (index % 3u) * 6u;
    let cell = cells[cell_index];
    var out: Corner;
    let steps = vec3u(
        half_word(triangle, first),
        half_word(triangle, first + 1u),
        half_word(triangle, first + 2u),
    );
    let place = bent(index, place_in(cell, steps));
    let along = dot(place, frame.forward);
    let off = vec2f(dot(place, frame.right), -dot(place, frame.down)) * frame.scale * 2.0 / frame.size;
    if frame.parallel != 0u {
        out.position = vec4f(off, depth_value(along), 1.0);
    } else {
        out.position = vec4f(off, frame.near, along);
    }
    let material = half_word(triangle, 18u);
    let m = materials[material];
    out.uv = m.uv_min + m.uv_step
        * vec2f(f32(half_word(triangle, first + 3u)), f32(half_word(triangle, first + 4u)));
    let axis = half_word(triangle, first + 5u);
    out.normal = bent_axis(index, turned(cell.turn, decode_axis(vec2u(axis & 0xffu, axis >> 8u))));
    out.tint = vec4f(1.0);
    if (m.flags & 2u) != 0u {
        let c = unpack4x8unorm(colors[index]);
        out.tint = vec4f(srgb_to_linear(c.rgb), c.a);
    }
    out.place = place;
    out.seen = seen_at(place) * exp(-cell.clump);
    out.what = vec3u(triangle, material, cell_index);
    return out;
}

@fragment
fn fragment(in: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let steps = Steps(dpdx(in.place), dpdy(in.place), dpdx(in.uv), dpdy(in.uv));
    let m = materials[in.what.y];
    let at = vec2u(in.position.xy);
    let seen = surface_at(m, in.uv, in.tint);
    // Points and triangles have different numbers for the hash rule (SPEC.md, section 5.4).
    let cell = cells[in.what.z];
    let id = (in.what.x + cell.first_triangle) ^ cell.mask;
    let opacity = u32(round(seen.a * 255.0));
    if !(covers(id, at, opacity) && fades_in(cell.fade, at)) {
        discard;
    }
    if (m.flags & 1u) != 0u {
        return vec4f(seen.rgb, 1.0);
    }
    let smooth_normal = normalize(select(-in.normal, in.normal, front));
    let normal = bumpy(m, smooth_normal, front, in.uv, steps);
    return vec4f(seen.rgb * light_through(translucency_of(m), normal, in.seen.x, in.seen.y * skyward(normal)), 1.0);
}
