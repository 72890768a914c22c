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
    // Share of the sun that cards get of what reaches them.
    sunlit: f32,
    // Of the zero of vertices, from the eye that leaves turn about: in a shadow map the picture's.
    turning: vec3f,
    // Share of the light's translucency that cards have.
    through: f32,
}

// The parallel camera of a shadow map.
struct SunView {
    // From the picture's eye to the sun's.
    eye: vec3f,
    // Texels that a world unit takes.
    scale: f32,
    right: vec3f,
    side: f32,
    down: vec3f,
    // What is less far behind the map's surface is lit.
    bias: f32,
    forward: vec3f,
    // Depth from which the map counts, and its range.
    near: f32,
    range: f32,
    zero0: f32,
    zero1: f32,
    zero2: f32,
}

// Of the range of a shadow map: as many as a half float tells apart.
const PARTS = 2048.0;

// Ten words each: forest_foliage::VertexRecord.
@group(1) @binding(0) var<storage, read> vertices: array<u32>;
@group(1) @binding(1) var<storage, read> indices: array<u32>;
@group(1) @binding(4) var<storage, read> branches: array<Branch>;
@group(1) @binding(6) var<storage, read> poses: array<BranchPose>;
@group(1) @binding(7) var<uniform> foliage: Foliage;
@group(1) @binding(8) var dictionary: texture_2d<f32>;
@group(1) @binding(9) var<uniform> sun_view: SunView;
@group(1) @binding(10) var shadow_map: texture_2d<f32>;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) normal: vec3f,
    @location(2) tint: vec4f,
    // Share of the sky that is seen.
    @location(3) skylit: f32,
    // Number of the triangle in the level, and material.
    @location(4) @interpolate(flat) what: vec2u,
    // From the eye.
    @location(5) place: vec3f,
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
        let branch = branch_of(word.x);
        let s = share_of(word.x);
        let flutter = f32(word.w >> 24u) / 255.0;
        if flutter > 0.0 {
            let steps = vec3f(vec3i(vec3u(word.y << 16u, word.y, word.z << 16u)) >> vec3u(16u));
            let pivot = place + steps * foliage.pivot_step;
            let turns = fract(foliage.swing + f32(word.z >> 16u) / 65536.0);
            let angle = foliage.flutter * sin(turns * 2.0 * HALF_TURN) * flutter;
            let to_eye = normalize(-foliage.turning - pivot);
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
    out.skylit = f32(word.w >> 16u & 0xffu) / 255.0;
    out.place = place;
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

// Whether the sun is seen from a place: forest_raster::ShadowMap.
fn shadow_at(place: vec3f) -> f32 {
    let off = place - sun_view.eye;
    let at = 0.5 * sun_view.side + sun_view.scale * vec2f(dot(off, sun_view.right), dot(off, sun_view.down));
    if any(at < vec2f(0.0)) || any(at >= vec2f(sun_view.side)) {
        return 1.0;
    }
    let stored = textureLoad(shadow_map, vec2u(at), 0).xy;
    let surface = (stored.x + stored.y / PARTS) * sun_view.range + sun_view.near;
    return select(0.0, 1.0, dot(off, sun_view.forward) - sun_view.bias < surface);
}

// Base colour and coverage, and whether it is shown as it is.
struct Surface {
    color: vec4f,
    unlit: bool,
    // Share of the light's translucency.
    through: f32,
}

fn surface_of(in: Corner) -> Surface {
    if in.what.y == DICTIONARY {
        return Surface(dictionary_at(in.uv) * in.tint, false, foliage.through);
    }
    let m = materials[in.what.y];
    return Surface(surface_at(m, in.uv, in.tint), (m.flags & 1u) != 0u, translucency_of(m));
}

fn is_covered_by(in: Corner, alpha: f32) -> bool {
    return covers(in.what.x, vec2u(in.position.xy), u32(round(clamp(alpha, 0.0, 1.0) * 255.0)));
}

// Depth along the sun's axis over the range of the frame, in whole parts and the rest: half floats are drawn
// into everywhere.
@fragment
fn shadow_fragment(in: Corner) -> @location(0) vec4f {
    if !is_covered_by(in, surface_of(in).color.a) {
        discard;
    }
    let depth = (dot(in.place, frame.forward) - frame.depth.x) * frame.depth.y * PARTS;
    return vec4f(floor(depth) / PARTS, fract(depth), 0.0, 0.0);
}

@fragment
fn fragment(in: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let steps = Steps(dpdx(in.place), dpdy(in.place), dpdx(in.uv), dpdy(in.uv));
    let surface = surface_of(in);
    if !is_covered_by(in, surface.color.a) || !fades_in(foliage.fade, vec2u(in.position.xy)) {
        discard;
    }
    let rgb = surface.color.rgb;
    if surface.unlit || frame.lit == 0u {
        return vec4f(rgb, 1.0);
    }
    let sunlit = shadow_at(in.place);
    if in.what.y == DICTIONARY {
        // Cards show many leaves, which face all ways.
        let direct = scattered(dot(to_eye(in.place), frame.to_sun), surface.through * frame.translucency);
        return vec4f(rgb * (frame.sun * (direct * foliage.sunlit * sunlit) + frame.sky * in.skylit), 1.0);
    }
    let smooth_normal = normalize(select(-in.normal, in.normal, front));
    let normal = bumpy(materials[in.what.y], smooth_normal, front, in.uv, steps);
    return vec4f(rgb * light_through(surface.through, normal, sunlit, in.skylit), 1.0);
}
