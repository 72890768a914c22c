// The triangles of a points pack, read from their records, with their textures at full resolution
// and the alpha rule of their materials.

struct Material {
    base: vec4f,
    uv_min: vec2f,
    uv_step: vec2f,
    // 0 opaque, 1 mask, 2 blend.
    rule: u32,
    cutoff: f32,
    // Bit 0: unlit. Bit 1: its triangles have vertex colours.
    flags: u32,
    // Number of the texture; all ones for none.
    image: u32,
}

struct Image {
    // Where it lies.
    corner: vec2u,
    layer: u32,
    zero: u32,
    size: vec2u,
    // Along u and v: 0 repeat, 1 mirror, 2 clamp.
    wrap: vec2u,
}

// Ten words each.
@group(1) @binding(0) var<storage, read> triangles: array<u32>;
@group(1) @binding(1) var<storage, read> cells: array<Cell>;
@group(1) @binding(2) var<storage, read> materials: array<Material>;
@group(1) @binding(3) var<storage, read> images: array<Image>;
// Three words for each triangle, if there are vertex colours.
@group(1) @binding(4) var<storage, read> colors: array<u32>;
@group(1) @binding(5) var sheet: texture_2d_array<f32>;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) normal: vec3f,
    @location(2) tint: vec4f,
    // Shares of the sun and of the sky that are seen.
    @location(3) seen: vec2f,
    // Number of the triangle, material, and cell.
    @location(4) @interpolate(flat) what: vec3u,
}

// Half a word of a triangle record.
fn half_word(triangle: u32, n: u32) -> u32 {
    return (triangles[triangle * 10u + (n >> 1u)] >> ((n & 1u) * 16u)) & 0xffffu;
}

// Corner number `index` of all, in a cell.
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
    let place = place_in(cell, steps);
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
    out.normal = turned(cell.turn, decode_axis(vec2u(axis & 0xffu, axis >> 8u)));
    out.tint = vec4f(1.0);
    if (m.flags & 2u) != 0u {
        let c = unpack4x8unorm(colors[index]);
        out.tint = vec4f(srgb_to_linear(c.rgb), c.a);
    }
    out.seen = seen_at(place) * exp(-cell.clump);
    out.what = vec3u(triangle, material, cell_index);
    return out;
}

fn wrapped(rule: u32, i: i32, n: i32) -> i32 {
    if rule == 2u {
        return clamp(i, 0, n - 1);
    }
    let turn = select(n, 2 * n, rule == 1u);
    let m = ((i % turn) + turn) % turn;
    return select(m, turn - 1 - m, m >= n);
}

// Premultiplied linear RGBA of a texel.
fn texel(image: Image, at: vec2i, opaque: bool) -> vec4f {
    let size = vec2i(image.size);
    let x = wrapped(image.wrap.x, at.x, size.x);
    let y = wrapped(image.wrap.y, at.y, size.y);
    let c = textureLoad(sheet, vec2i(image.corner) + vec2i(x, y), image.layer, 0);
    let a = select(c.a, 1.0, opaque);
    return vec4f(c.rgb * a, a);
}

fn sampled(image: Image, uv: vec2f, opaque: bool) -> vec4f {
    let at = uv * vec2f(image.size) - 0.5;
    let low = floor(at);
    let f = at - low;
    // Texture coordinates of hostile files do not fit an integer.
    let i = vec2i(clamp(low, vec2f(-1e9), vec2f(1e9)));
    let top = mix(texel(image, i, opaque), texel(image, i + vec2i(1, 0), opaque), f.x);
    let bottom = mix(texel(image, i + vec2i(0, 1), opaque), texel(image, i + 1, opaque), f.x);
    return mix(top, bottom, f.y);
}

@fragment
fn fragment(in: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let m = materials[in.what.y];
    let at = vec2u(in.position.xy);
    var rgb = m.base.rgb;
    var alpha = m.base.a * in.tint.a;
    if m.image != 0xffffffffu {
        let c = sampled(images[m.image], in.uv, m.rule == 0u);
        rgb *= select(vec3f(0.0), c.rgb / c.a, c.a > 0.0);
        alpha *= c.a;
    }
    // forest_soup::Material::coverage.
    var coverage = 1.0;
    if m.rule == 1u {
        coverage = select(0.0, 1.0, alpha >= m.cutoff);
    } else if m.rule == 2u {
        coverage = clamp(alpha, 0.0, 1.0);
    }
    // Points and triangles have different numbers for the hash rule (SPEC.md, section 5.4).
    let cell = cells[in.what.z];
    let id = (in.what.x + cell.first_triangle) ^ cell.mask;
    let opacity = u32(round(coverage * 255.0));
    if !(covers(id, at, opacity) && fades_in(cell.fade, at)) {
        discard;
    }
    rgb *= in.tint.rgb;
    if (m.flags & 1u) != 0u {
        return vec4f(rgb, 1.0);
    }
    let normal = normalize(select(-in.normal, in.normal, front));
    return vec4f(rgb * light(normal, in.seen.x, in.seen.y * skyward(normal)), 1.0);
}
