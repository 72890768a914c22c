// The meshes of foliage.

struct Foliage {
    // Of the zero of vertices, from the eye.
    origin: vec3f,
    // World units of a step of pivots.
    pivot_step: f32,
    // Share of the samples.
    fade: vec2f,
    // First vertex and triangle of the level.
    first_vertex: u32,
    first_triangle: u32,
    // By how much leaves turn, and where in their swing they are, in turns.
    flutter: f32,
    swing: f32,
    // Whether there is wind.
    windy: u32,
    zero: u32,
}

// Ten words each: forest_foliage::VertexRecord.
@group(1) @binding(0) var<storage, read> vertices: array<u32>;
@group(1) @binding(1) var<storage, read> indices: array<u32>;
@group(1) @binding(4) var<storage, read> branches: array<Branch>;
@group(1) @binding(6) var<storage, read> poses: array<BranchPose>;
@group(1) @binding(7) var<uniform> foliage: Foliage;
@group(1) @binding(8) var dictionary: texture_2d<f32>;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) normal: vec3f,
    @location(2) tint: vec4f,
    @location(3) seen: vec2f,
    // Number of the triangle in the level, and material.
    @location(4) @interpolate(flat) what: vec2u,
}

// An instance is a material.
@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) material: u32) -> Corner {
    let first = (foliage.first_vertex + indices[3u * foliage.first_triangle + index]) * 10u;
    let word = vec4u(vertices[first + 5u], vertices[first + 6u], vertices[first + 7u], vertices[first + 8u]);
    var place = vec3f(
        bitcast<f32>(vertices[first]),
        bitcast<f32>(vertices[first + 1u]),
        bitcast<f32>(vertices[first + 2u]),
    );
    var normal = decode_axis(vec2u(word.w & 0xffu, word.w >> 8u & 0xffu));
    if foliage.windy != 0u {
        let branch = word.x & 0xffffu;
        let s = f32(word.x >> 16u) / 65535.0;
        let flutter = f32(word.w >> 24u) / 255.0;
        if flutter > 0.0 {
            let steps = vec3f(vec3i(vec3u(word.y << 16u, word.y, word.z << 16u)) >> vec3u(16u));
            let pivot = place + steps * foliage.pivot_step;
            let turns = fract(foliage.swing + f32(word.z >> 16u) / 65536.0);
            let angle = foliage.flutter * sin(turns * 2.0 * HALF_TURN) * flutter;
            // The eye lies at minus the origin.
            let to_eye = normalize(-foliage.origin - pivot);
            place = pivot + turned_about(place - pivot, to_eye, angle);
        }
        place = bent_place(branches[branch], poses[branch], place, s);
        normal = bent_direction(poses[branch], normal, s);
    }
    place += foliage.origin;
    let along = dot(place, frame.forward);
    let off = vec2f(dot(place, frame.right), -dot(place, frame.down)) * frame.scale * 2.0 / frame.size;
    var out: Corner;
    if frame.parallel != 0u {
        out.position = vec4f(off, depth_value(along), 1.0);
    } else {
        out.position = vec4f(off, frame.near, along);
    }
    out.uv = vec2f(bitcast<f32>(vertices[first + 3u]), bitcast<f32>(vertices[first + 4u]));
    out.normal = normal;
    let c = unpack4x8unorm(vertices[first + 9u]);
    out.tint = vec4f(srgb_to_linear(c.rgb), c.a);
    out.seen = seen_at(place);
    out.what = vec2u(index / 3u, material);
    return out;
}

// Premultiplied linear RGBA of the dictionary.
fn dictionary_texel(at: vec2i) -> vec4f {
    let last = vec2i(textureDimensions(dictionary)) - 1;
    let c = textureLoad(dictionary, clamp(at, vec2i(0), last), 0);
    return vec4f(c.rgb * c.a, c.a);
}

fn dictionary_at(uv: vec2f) -> vec4f {
    let at = uv * vec2f(textureDimensions(dictionary)) - 0.5;
    let low = floor(at);
    let f = at - low;
    let i = vec2i(low);
    let top = mix(dictionary_texel(i), dictionary_texel(i + vec2i(1, 0)), f.x);
    let bottom = mix(dictionary_texel(i + vec2i(0, 1)), dictionary_texel(i + 1), f.x);
    let c = mix(top, bottom, f.y);
    return vec4f(select(vec3f(0.0), c.rgb / c.a, c.a > 0.0), c.a);
}

@fragment
fn fragment(in: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    var seen: vec4f;
    var unlit = false;
    if in.what.y == DICTIONARY {
        seen = dictionary_at(in.uv) * in.tint;
    } else {
        let m = materials[in.what.y];
        seen = surface_at(m, in.uv, in.tint);
        unlit = (m.flags & 1u) != 0u;
    }
    let at = vec2u(in.position.xy);
    let opacity = u32(round(clamp(seen.a, 0.0, 1.0) * 255.0));
    if !(covers(in.what.x, at, opacity) && fades_in(foliage.fade, at)) {
        discard;
    }
    if unlit {
        return vec4f(seen.rgb, 1.0);
    }
    let normal = normalize(select(-in.normal, in.normal, front));
    return vec4f(seen.rgb * light(normal, in.seen.x, in.seen.y * skyward(normal)), 1.0);
}
