// The light between the trees of a landscape, from its opacity maps (forest_scene::OpacityMap).

struct LightMap {
    // Unit vector towards the light.
    light: vec3f,
    // Metres of a texel.
    texel: f32,
    // Where the first texel begins on the ground plane.
    corner: vec2f,
    // Texels along x and z.
    size: vec2u,
    // Height of code 0, and codes in a metre.
    low: f32,
    steps: f32,
    zero: vec2u,
}

struct Land {
    sun: LightMap,
    sky: LightMap,
    // The eye in the scene, in two parts: their sum is exact.
    eye: vec3f,
    // s_m and s_M in square pixels.
    finest: f32,
    eye_rest: vec3f,
    largest: f32,
    // Linear RGB of the sky behind everything.
    horizon: vec3f,
    // Most points that are drawn where they are chosen.
    few: u32,
    zenith: vec3f,
    // Power of the share that is seen: thresholds grow by it.
    hidden: f32,
    // Samples along the side of a pixel.
    pixel: f32,
    // How many times as large as one as fine as points an impostor may be.
    impostors: f32,
    // What less light than this comes through to the eye from is left out.
    least_seen: f32,
    zero: f32,
    // Its direction along x and z as long as it is strong, seconds, and swings a second.
    wind: vec4f,
}

@group(0) @binding(1) var<uniform> land: Land;
@group(0) @binding(2) var<storage, read> sun_map: array<vec2u>;
@group(0) @binding(3) var<storage, read> sky_map: array<vec2u>;

// A place of the scene, from the eye. Differences near the eye are exact.
fn from_eye(place: vec3f) -> vec3f {
    return (place - land.eye) - land.eye_rest;
}

// Optical depth above height `y` (in codes) of a texel.
fn depth_above(texel: vec2u, y: f32) -> f32 {
    let slab = vec2f(f32(texel.x & 0xffffu), f32(texel.x >> 16u));
    let share = (slab.x - y) / max(slab.x - slab.y, 1.0);
    return f32(texel.y & 0xffffu) / DEPTH_STEPS * clamp(share, 0.0, 1.0);
}

// Where and between which texels a place lies.
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
    if !is_in(land.sun, at) {
        return 0.0;
    }
    return depth_above(sun_map[u32(at.y) * land.sun.size.x + u32(at.x)], y);
}

fn sky_depth(at: vec2i, y: f32) -> f32 {
    if !is_in(land.sky, at) {
        return 0.0;
    }
    return depth_above(sky_map[u32(at.y) * land.sky.size.x + u32(at.x)], y);
}

// Share of the sky, weighted by cosines, that a surface is turned to; the rest is ground.
fn skyward(normal: vec3f) -> f32 {
    return 0.5 + 0.5 * normal.y;
}

// Shares of the sun and of the sky that are seen at a place from the eye, of the texels around it.
fn seen_smoothly(off: vec3f) -> vec2f {
    let place = off + land.eye;
    let a = map_place(land.sun, place);
    let i = vec2i(1, 0);
    let sun = mix(
        mix(sun_depth(a.at, a.y), sun_depth(a.at + i.xy, a.y), a.part.x),
        mix(sun_depth(a.at + i.yx, a.y), sun_depth(a.at + i.xx, a.y), a.part.x),
        a.part.y,
    );
    let b = map_place(land.sky, place);
    let sky = mix(
        mix(sky_depth(b.at, b.y), sky_depth(b.at + i.xy, b.y), b.part.x),
        mix(sky_depth(b.at + i.yx, b.y), sky_depth(b.at + i.xx, b.y), b.part.x),
        b.part.y,
    );
    return exp(-vec2f(sun, DIFFUSE * sky));
}

// The same of the nearest texels: points are many.
fn seen_at(off: vec3f) -> vec2f {
    let place = off + land.eye;
    let a = map_place(land.sun, place);
    let b = map_place(land.sky, place);
    return exp(-vec2f(
        sun_depth(a.at + vec2i(a.part + 0.5), a.y),
        DIFFUSE * sky_depth(b.at + vec2i(b.part + 0.5), b.y),
    ));
}

// Optical depth of the trees between a place from the eye and the eye, of which the first `own` metres do
// not count: the sky's map holds how dense they are, by height. `VIEW_STEPS` places are asked on the way,
// the more the nearer.
fn depth_to_eye(place: vec3f, own: f32) -> f32 {
    let toward = -normalize(place);
    let off = place + toward * own;
    let distance = max(length(place) - own, 0.0);
    // No farther than up to the highest tree.
    let high = land.sky.low + HEIGHT_STEPS / land.sky.steps - (off.y + land.eye.y);
    let rise = max(toward.y, 1e-4);
    let reach = min(distance, select(distance, high / rise, toward.y > 0.0));
    var sum = 0.0;
    for (var k = 0u; k < VIEW_STEPS; k++) {
        let t = (f32(k) + 0.5) / f32(VIEW_STEPS);
        // Squares: steps grow with the distance from the place.
        let at = map_place(land.sky, off + land.eye + toward * (reach * t * t));
        let texel_at = at.at + vec2i(at.part + 0.5);
        if !is_in(land.sky, texel_at) {
            continue;
        }
        let texel = sky_map[u32(texel_at.y) * land.sky.size.x + u32(texel_at.x)];
        let slab = vec2f(f32(texel.x & 0xffffu), f32(texel.x >> 16u));
        if at.y < slab.x && at.y > slab.y {
            let thick = max(slab.x - slab.y, 1.0) / land.sky.steps;
            sum += f32(texel.y & 0xffffu) / DEPTH_STEPS / thick * 2.0 * t;
        }
    }
    return sum * reach / f32(VIEW_STEPS);
}

// Colours of splatted points: the square root of a quarter, 11, 11 and 10 bits; never 0.
fn pack_color(rgb: vec3f) -> u32 {
    let v = vec3u(sqrt(clamp(rgb * 0.25, vec3f(0.0), vec3f(1.0))) * vec3f(2047.0, 2047.0, 1023.0) + 0.5);
    return max(v.x | (v.y << 11u) | (v.z << 22u), 1u);
}

fn unpack_color(word: u32) -> vec3f {
    let v = vec3f(f32(word & 0x7ffu), f32((word >> 11u) & 0x7ffu), f32(word >> 22u));
    let root = v / vec3f(2047.0, 2047.0, 1023.0);
    return 4.0 * root * root;
}
