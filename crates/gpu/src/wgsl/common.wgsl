// What all passes know: the camera, the light and the hash rule.
// Constants in capitals that are not declared here come from the Rust crates.

struct Frame {
    // Axes of the picture in the world, y down.
    right: vec3f,
    // Pixels that a world unit takes at distance 1 (perspective), or anywhere (parallel).
    scale: f32,
    down: vec3f,
    parallel: u32,
    forward: vec3f,
    // Nearest distance that a perspective eye sees.
    near: f32,
    // Pixels.
    size: vec2f,
    // Depth that is 1 in the depth buffer of a parallel camera, and one over the range behind it.
    depth: vec2f,
    to_sun: vec3f,
    // 0: base colours, 1: sun and sky.
    lit: u32,
    sun: vec3f,
    translucency: f32,
    sky: vec3f,
    // L_m over L_M of the estimated self-shadow; 1 without.
    darkest: f32,
    // Of the block, from the eye, and half its diagonal: what Z of the self-shadow is measured by.
    middle: vec3f,
    half_diagonal: f32,
    // How the block leans in the wind, and the height of its foot from the eye.
    lean: vec2f,
    foot: f32,
    // 1 if points bend with the branches of a block whose zero is at `root` from the eye.
    bends: u32,
    root: vec3f,
    // 1 if volumes are lit: they are base colours.
    relit: u32,
    // Of the sun and the sky that come through a crown, what is seen: forest_foliage::CrownLight.
    crown: vec2f,
    zero: vec2f,
    // Corner of the grid of what comes through, from the eye, and one over the side of its cells.
    shade_low: vec3f,
    shade_scale: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Picture coordinates in pixels and depth along the axis, of a place from the eye.
fn project(place: vec3f) -> vec3f {
    let depth = dot(place, frame.forward);
    let s = select(frame.scale / depth, frame.scale, frame.parallel != 0u);
    return vec3f(0.5 * frame.size + s * vec2f(dot(place, frame.right), dot(place, frame.down)), depth);
}

fn is_behind(depth: f32) -> bool {
    return frame.parallel == 0u && depth <= frame.near;
}

// 1 near … 0 far: depths of all passes are compared as these.
fn depth_value(depth: f32) -> f32 {
    let along = 1.0 - (depth - frame.depth.x) * frame.depth.y;
    return select(frame.near / depth, along, frame.parallel != 0u);
}

// The depth along the axis of a depth value.
fn depth_of(value: f32) -> f32 {
    let along = (1.0 - value) / frame.depth.y + frame.depth.x;
    return select(frame.near / value, along, frame.parallel != 0u);
}

// Place from the eye of picture coordinates at a depth.
fn unproject(at: vec2f, depth: f32) -> vec3f {
    let s = select(depth / frame.scale, 1.0 / frame.scale, frame.parallel != 0u);
    let off = (at - 0.5 * frame.size) * s;
    return frame.right * off.x + frame.down * off.y + frame.forward * depth;
}

// Unit vector towards the eye.
fn to_eye(place: vec3f) -> vec3f {
    return select(-normalize(place), -frame.forward, frame.parallel != 0u);
}

// Clip coordinates of picture coordinates and a depth value.
fn flat_clip(at: vec2f, value: f32) -> vec4f {
    let ndc = at / frame.size * 2.0 - 1.0;
    return vec4f(ndc.x, -ndc.y, value, 1.0);
}

// --- forest_raster::covers, sample_hash -------------------------------------------------------

fn mix_bits(word: u32) -> u32 {
    var v = word;
    v ^= v >> 16u;
    v *= 0x7feb352du;
    v ^= v >> 15u;
    v *= 0x846ca68bu;
    return v ^ (v >> 16u);
}

fn hash16(id: u32, at: vec2u) -> u32 {
    let sample = mix_bits((at.x * 0x9e3779b9u) ^ ((at.y << 16u) | (at.y >> 16u)));
    return mix_bits(id ^ sample) >> 16u;
}

fn covers(id: u32, at: vec2u, opacity: u32) -> bool {
    return opacity == 255u || hash16(id, at) * 255u < (opacity << 16u);
}

fn sample_hash(id: u32, at: vec2u) -> f32 {
    return f32(hash16(id, at)) / 65536.0;
}

// Whether a layer that draws the share `fade.x..fade.y` of all samples draws this one. Shares that
// do not overlap never draw the same sample: levels that cross-fade neither add up nor leave holes.
fn fades_in(fade: vec2f, at: vec2u) -> bool {
    if fade.x <= 0.0 && fade.y >= 1.0 {
        return true;
    }
    let h = sample_hash(FADE, at);
    return h >= fade.x && h < fade.y;
}

// --- forest_foliage::Sway -----------------------------------------------------------------------

fn sway_at(y: f32, foot: f32, lean: vec2f) -> vec3f {
    let height = max(y - foot, 0.0);
    return vec3f(lean.x, 0.0, lean.y) * (height * height);
}

// --- light ------------------------------------------------------------------------------------

fn srgb_to_linear(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn linear_to_srgb(c: vec3f) -> vec3f {
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3f(0.0031308));
}

// Factors on a base colour: forest_raster::Sun. The normal faces the eye.
fn light(normal: vec3f, sunlit: f32, skylit: f32) -> vec3f {
    return light_through(1.0, normal, sunlit, skylit);
}

// The same on a surface that has a share `through` of the light's translucency.
fn light_through(through: f32, normal: vec3f, sunlit: f32, skylit: f32) -> vec3f {
    if frame.lit == 0u {
        return vec3f(1.0);
    }
    let c = dot(normal, frame.to_sun);
    let direct = (max(c, 0.0) + through * frame.translucency * max(-c, 0.0)) * sunlit;
    return frame.sun * direct + frame.sky * skylit;
}

// Factor on the light of what is drawn with this gain: forest_foliage::Gain.
fn on_crown(gain: f32) -> f32 {
    return select(1.0, gain, frame.relit != 0u);
}

// forest_raster::scattered
fn scattered(cosine: f32, translucency: f32) -> f32 {
    let c = clamp(cosine, -1.0, 1.0);
    let angle = acos(c);
    let s = sqrt(1.0 - c * c);
    return 2.0 / (3.0 * HALF_TURN) * (s + (HALF_TURN - angle) * c + translucency * (s - angle * c));
}

// The unit vector of two octahedral bytes: forest_points::record::decode_axis.
fn decode_axis(code: vec2u) -> vec3f {
    let v = (vec2f(max(code, vec2u(1u))) - 128.0) / 127.0;
    let z = 1.0 - abs(v.x) - abs(v.y);
    let fold = max(-z, 0.0);
    let s = select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
    return normalize(vec3f(v - s * fold, z));
}
