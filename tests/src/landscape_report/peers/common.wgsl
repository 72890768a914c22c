// What all peers share: the view, the trees and the light, which is that of light.wgsl.

struct LightMap {
    light: vec3f,
    texel: f32,
    corner: vec2f,
    size: vec2u,
    low: f32,
    steps: f32,
    zero: vec2u,
}

struct View {
    right: vec3f,
    // From the picture's axes to clip coordinates.
    wide: f32,
    up: vec3f,
    tall: f32,
    forward: vec3f,
    near: f32,
    // The eye in two parts: their sum is exact.
    eye: vec3f,
    zero: f32,
    eye_rest: vec3f,
    translucency: f32,
    to_sun: vec3f,
    zero1: f32,
    sun: vec3f,
    zero2: f32,
    sky: vec3f,
    zero3: f32,
    horizon: vec3f,
    zero4: f32,
    zenith: vec3f,
    zero5: f32,
    sun_map: LightMap,
    sky_map: LightMap,
}

struct Tree {
    foot: vec3f,
    scale: f32,
    // Cosine and sine of its yaw, the yaw itself, and zero.
    turn: vec2f,
    yaw: f32,
    // Share of all light that comes through the clump around a leaf.
    dark: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> sun_texels: array<vec2u>;
@group(0) @binding(2) var<storage, read> sky_texels: array<vec2u>;
@group(0) @binding(3) var<storage, read> trees: array<Tree>;
@group(0) @binding(4) var<storage, read> list: array<u32>;

fn from_eye(place: vec3f) -> vec3f {
    return (place - view.eye) - view.eye_rest;
}

fn clip(off: vec3f) -> vec4f {
    let flat = vec2f(dot(off, view.right) * view.wide, dot(off, view.up) * view.tall);
    return vec4f(flat, view.near, dot(off, view.forward));
}

fn turned(turn: vec2f, v: vec3f) -> vec3f {
    return vec3f(turn.x * v.x + turn.y * v.z, v.y, turn.x * v.z - turn.y * v.x);
}

fn srgb_to_linear(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn decode_axis(code: vec2u) -> vec3f {
    let v = (vec2f(max(code, vec2u(1u))) - 128.0) / 127.0;
    let z = 1.0 - abs(v.x) - abs(v.y);
    let fold = max(-z, 0.0);
    let s = select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
    return normalize(vec3f(v - s * fold, z));
}

// Factors on a base colour; the normal faces the eye.
fn light(normal: vec3f, seen: vec2f) -> vec3f {
    let c = dot(normal, view.to_sun);
    let direct = (max(c, 0.0) + view.translucency * max(-c, 0.0)) * seen.x;
    return view.sun * direct + view.sky * (seen.y * (0.5 + 0.5 * normal.y));
}

fn depth_above(texel: vec2u, y: f32) -> f32 {
    let slab = vec2f(f32(texel.x & 0xffffu), f32(texel.x >> 16u));
    let share = (slab.x - y) / max(slab.x - slab.y, 1.0);
    return f32(texel.y & 0xffffu) / DEPTH_STEPS * clamp(share, 0.0, 1.0);
}

struct MapPlace {
    at: vec2i,
    part: vec2f,
    y: f32,
}

fn map_place(map: LightMap, place: vec3f) -> MapPlace {
    let on_plane = place.xz - map.light.xz * (place.y / map.light.y);
    let at = (on_plane - map.corner) / map.texel - 0.5;
    let low = floor(at);
    return MapPlace(vec2i(clamp(low, vec2f(-2.0), vec2f(1e6))), at - low, (place.y - map.low) * map.steps);
}

fn is_in(map: LightMap, at: vec2i) -> bool {
    return all(at >= vec2i(0)) && all(at < vec2i(map.size));
}

fn sun_depth(at: vec2i, y: f32) -> f32 {
    if !is_in(view.sun_map, at) {
        return 0.0;
    }
    return depth_above(sun_texels[u32(at.y) * view.sun_map.size.x + u32(at.x)], y);
}

fn sky_depth(at: vec2i, y: f32) -> f32 {
    if !is_in(view.sky_map, at) {
        return 0.0;
    }
    return depth_above(sky_texels[u32(at.y) * view.sky_map.size.x + u32(at.x)], y);
}

fn seen_smoothly(off: vec3f) -> vec2f {
    let place = off + view.eye;
    let a = map_place(view.sun_map, place);
    let i = vec2i(1, 0);
    let sun = mix(
        mix(sun_depth(a.at, a.y), sun_depth(a.at + i.xy, a.y), a.part.x),
        mix(sun_depth(a.at + i.yx, a.y), sun_depth(a.at + i.xx, a.y), a.part.x),
        a.part.y,
    );
    let b = map_place(view.sky_map, place);
    let sky = mix(
        mix(sky_depth(b.at, b.y), sky_depth(b.at + i.xy, b.y), b.part.x),
        mix(sky_depth(b.at + i.yx, b.y), sky_depth(b.at + i.xx, b.y), b.part.x),
        b.part.y,
    );
    return exp(-vec2f(sun, DIFFUSE * sky));
}

fn seen_at(off: vec3f) -> vec2f {
    let place = off + view.eye;
    let a = map_place(view.sun_map, place);
    let b = map_place(view.sky_map, place);
    return exp(-vec2f(
        sun_depth(a.at + vec2i(a.part + 0.5), a.y),
        DIFFUSE * sky_depth(b.at + vec2i(b.part + 0.5), b.y),
    ));
}
