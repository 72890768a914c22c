// Views: a quad about the ball that holds the tree, each sample a ray through one to three views.
// The functions are those of forest_views::lookup and forest_draw::views, and are named like them.

struct Sprite {
    // From the centre of the tiles to the eye, in units of half a tile.
    eye: vec3f,
    // World units in half a tile.
    half: f32,
    // Numbers of the views, and how many there are.
    views: vec4u,
    // Their shares, which add to 1.
    shares: vec4f,
    // First and last pixel of the box.
    low: vec2f,
    high: vec2f,
    fade: vec2f,
    // Texels along the side of a whole tile.
    side: f32,
    // Radius of the ball that holds the tree, in units of half a tile.
    reach: f32,
    // 1 if the ray is followed through depth.
    through_depth: u32,
    // Normals, sky: 1 if they are stored.
    has_normals: u32,
    has_sky: u32,
    // 1 if depth is stored in two bytes a texel.
    wide_depth: u32,
    // Texels across and down a page.
    page: vec2u,
}

@group(1) @binding(0) var<uniform> sprite: Sprite;
@group(1) @binding(1) var<storage, read> tiles: array<vec4u>;
@group(1) @binding(2) var<storage, read> view_frames: array<ViewFrame>;
@group(1) @binding(3) var color_pages: texture_2d_array<f32>;
@group(1) @binding(4) var normal_pages: texture_2d_array<f32>;
// As it is stored: two bytes a texel, or BC4 blocks. Texture units round blocks each in its own way,
// and where a ray meets the tree hangs on the last bit.
@group(1) @binding(5) var<storage, read> depth_words: array<u32>;
@group(1) @binding(6) var sky_pages: texture_2d_array<f32>;

struct Ray {
    origin: vec3f,
    direction: vec3f,
    // Distance from which it counts.
    from_distance: f32,
}

struct Hit {
    // FOUND_…
    found: u32,
    distance: f32,
    alpha: f32,
    rgb: vec3f,
    normal: vec3f,
    sky: f32,
}

const FOUND_EMPTY = 0u;
const FOUND_HIT = 1u;
const FOUND_HIDDEN = 2u;

fn ray_of(at: vec2f) -> Ray {
    let off = at - 0.5 * frame.size;
    let aside = (frame.right * off.x + frame.down * off.y) / frame.scale;
    if frame.parallel != 0u {
        return Ray(sprite.eye + aside / sprite.half, frame.forward, -3.0e38);
    }
    return Ray(sprite.eye, normalize(frame.forward + aside), 0.0);
}

// Depth of a texel of the pages: 0 at the front of the ball, 1 at its back.
fn depth_at(p: vec3u) -> f32 {
    let row = p.z * sprite.page.y + p.y;
    if sprite.wide_depth != 0u {
        let i = row * sprite.page.x + p.x;
        return f32((depth_words[i / 2u] >> ((i & 1u) * 16u)) & 0xffffu) / 65535.0;
    }
    let block = ((row / 4u) * (sprite.page.x / 4u) + p.x / 4u) * 2u;
    let low = depth_words[block];
    let high = depth_words[block + 1u];
    // Two ends of 8 bits, then 16 indices of 3.
    let at = 16u + 3u * ((row & 3u) * 4u + (p.x & 3u));
    var i: u32;
    if at >= 32u {
        i = high >> (at - 32u);
    } else {
        i = (low >> at) | select(0u, high << (32u - at), at > 29u);
    }
    i &= 7u;
    let ends = vec2f(f32(low & 0xffu), f32((low >> 8u) & 0xffu)) / 255.0;
    if i < 2u {
        return select(ends.x, ends.y, i == 1u);
    }
    let part = f32(i - 1u);
    if ends.x > ends.y {
        return (ends.x * (7.0 - part) + ends.y * part) / 7.0;
    }
    if i >= 6u {
        return f32(i - 6u);
    }
    return (ends.x * (5.0 - part) + ends.y * part) / 5.0;
}

// Height towards the view's camera of what texel `at` shows, in x; y is 0 where it covers no more
// than `threshold`.
fn surface(tile: Tile, at: vec2f, threshold: f32) -> vec2f {
    let p = page_texel(tile, vec2i(floor(at)));
    if p.x < 0 || textureLoad(color_pages, p.xy, p.z, 0).a <= threshold {
        return vec2f(0.0);
    }
    let depth = (round(depth_at(vec3u(p)) * 65535.0) + OFF_STEPS) / 65535.0;
    return vec2f(sprite.reach * (1.0 - 2.0 * depth), 1.0);
}

fn shade(view: u32, place: vec2f, distance: f32) -> Hit {
    let at = place - 0.5;
    let low = floor(at);
    let f = at - low;
    let first = vec2i(low);
    let tile = tile_of(view);
    var hit = Hit(FOUND_EMPTY, distance, 0.0, vec3f(0.0), view_frames[view].back.xyz, 1.0);
    var weight = 0.0;
    var best = 0.0;
    var best_texel = vec3i(0);
    for (var k = 0; k < 4; k++) {
        let d = vec2i(k & 1, k >> 1u);
        let p = page_texel(tile, first + d);
        if p.x < 0 {
            continue;
        }
        let shares = select(1.0 - f, f, d == vec2i(1));
        let share = shares.x * shares.y;
        let c = textureLoad(color_pages, p.xy, p.z, 0);
        hit.alpha += share * c.a;
        hit.rgb += share * c.rgb;
        weight += share;
        // Normals and sky of the texel that shows most.
        let part = share * (c.a * 255.0 + 1.0);
        if part > best {
            best = part;
            best_texel = p;
        }
    }
    if weight <= 0.0 {
        return hit;
    }
    hit.found = FOUND_HIT;
    hit.rgb /= weight;
    if sprite.has_normals != 0u {
        let n = textureLoad(normal_pages, best_texel.xy, best_texel.z, 0).xy * 2.0 - 1.0;
        let z = sqrt(max(1.0 - dot(n, n), 0.0));
        let v = view_frames[view];
        hit.normal = normalize(v.right.xyz * n.x + v.up.xyz * n.y + v.back.xyz * z);
    }
    if sprite.has_sky != 0u {
        hit.sky = textureLoad(sky_pages, best_texel.xy, best_texel.z, 0).x;
    }
    return hit;
}

// A ray as a view sees it: texel coordinates are linear in the height towards the view's camera.
struct Path {
    start: vec2f,
    gain: vec2f,
    // Distance along the ray at height 0, and its gain; a gain of 0 for a ray from behind the view.
    distance: vec2f,
}

fn path_of(view: u32, ray: Ray) -> Path {
    let v = view_frames[view];
    let slope = dot(ray.direction, v.back.xyz);
    if slope > BEHIND {
        return Path(vec2f(0.0), vec2f(0.0), vec2f(0.0));
    }
    let h = dot(ray.origin, v.back.xyz);
    let dh = 1.0 / slope;
    let at_zero = ray.origin - ray.direction * (h * dh);
    let scale = 0.5 * sprite.side;
    let start = (vec2f(dot(at_zero, v.right.xyz), -dot(at_zero, v.up.xyz)) + 1.0) * scale;
    let gain = vec2f(dot(ray.direction, v.right.xyz), -dot(ray.direction, v.up.xyz)) * (dh * scale);
    return Path(start, gain, vec2f(-h * dh, dh));
}

// The heights between which the ray is before the stored part of a tile, the higher one first.
fn heights_within(tile: Tile, path: Path) -> vec2f {
    let low = vec2f(tile.corner);
    let high = vec2f(tile.corner + tile.size);
    var heights = vec2f(3.0e38, -3.0e38);
    for (var k = 0; k < 2; k++) {
        if path.gain[k] == 0.0 {
            if path.start[k] < low[k] || path.start[k] >= high[k] {
                return vec2f(-3.0e38, 3.0e38);
            }
            continue;
        }
        let a = (low[k] - path.start[k]) / path.gain[k];
        let b = (high[k] - path.start[k]) / path.gain[k];
        heights = vec2f(min(heights.x, max(a, b)), max(heights.y, min(a, b)));
    }
    return heights;
}

fn at_plane(view: u32, ray: Ray) -> Hit {
    let path = path_of(view, ray);
    var hit: Hit;
    if path.distance.y == 0.0 {
        return hit;
    }
    hit = shade(view, path.start, path.distance.x);
    if hit.alpha <= 0.0 || hit.distance < ray.from_distance {
        hit.found = FOUND_EMPTY;
    }
    return hit;
}

fn along_depth(view: u32, ray: Ray, threshold: f32) -> Hit {
    let path = path_of(view, ray);
    var hit: Hit;
    if path.distance.y == 0.0 {
        return hit;
    }
    let steps = clamp(ceil(2.0 * sprite.reach * length(path.gain)), 1.0, MOST_STEPS);
    let stride = -2.0 * sprite.reach / steps;
    let joined = JOINED * 2.0 / sprite.side;
    // Height of the surface that the ray was before in the texel before this one.
    var ahead = 0.0;
    var is_ahead = false;
    // Where nothing is stored nothing is met.
    let tile = tile_of(view);
    let within = heights_within(tile, path);
    let first = u32(clamp((sprite.reach - within.x) / -stride - 1.0, 0.0, steps));
    let end = u32(clamp((sprite.reach - within.y) / -stride + 1.0, 0.0, steps));
    for (var n = first; n < end; n++) {
        let near = sprite.reach + stride * f32(n);
        let far = near + stride;
        if path.distance.x + path.distance.y * far < ray.from_distance {
            continue;
        }
        let s = surface(tile, path.start + path.gain * (0.5 * (near + far)), threshold);
        if s.y == 0.0 {
            is_ahead = false;
            continue;
        }
        if far > s.x {
            ahead = s.x;
            is_ahead = true;
            continue;
        }
        let met = is_ahead && s.x - ahead <= joined;
        is_ahead = false;
        if near >= s.x || met {
            let height = min(s.x, near);
            return shade(view, path.start + path.gain * height, path.distance.x + path.distance.y * height);
        }
        hit.found = FOUND_HIDDEN;
    }
    return hit;
}

fn hides(view: u32, ray: Ray, distance: f32, threshold: f32) -> bool {
    let v = view_frames[view];
    let place = ray.origin + ray.direction * distance;
    let at = (vec2f(dot(place, v.right.xyz), -dot(place, v.up.xyz)) + 1.0) * (0.5 * sprite.side);
    let s = surface(tile_of(view), at, threshold);
    return s.y != 0.0 && dot(place, v.back.xyz) < s.x + SLACK * 2.0 / sprite.side;
}

fn find(ray: Ray, at: vec2u) -> Hit {
    // The view that is asked first is drawn by the shares; the others follow.
    let count = sprite.views.w;
    var left = sample_hash(PICK, at);
    var first = count - 1u;
    for (var i = 0u; i < count; i++) {
        left -= sprite.shares[i];
        if left < 0.0 {
            first = i;
            break;
        }
    }
    var hit: Hit;
    if sprite.through_depth == 0u {
        hit = at_plane(sprite.views[first], ray);
        if hit.found == FOUND_HIT && !covers(COVER, at, u32(round(hit.alpha * 255.0))) {
            hit.found = FOUND_EMPTY;
        }
        return hit;
    }
    let threshold = sample_hash(COVER, at);
    for (var k = 0u; k < count; k++) {
        hit = along_depth(sprite.views[(first + k) % count], ray, threshold);
        if hit.found == FOUND_EMPTY {
            return hit;
        }
        if hit.found == FOUND_HIT {
            // What lies where another view saw nothing is not there.
            for (var j = 0u; j < k; j++) {
                if !hides(sprite.views[(first + j) % count], ray, hit.distance, threshold) {
                    hit.found = FOUND_EMPTY;
                    return hit;
                }
            }
            return hit;
        }
    }
    hit.found = FOUND_EMPTY;
    return hit;
}

// How far the tree leans where a ray passes its upright axis, in units of half a tile: the ray sees what
// stands there at rest.
fn sway_of(ray: Ray) -> vec3f {
    if all(frame.lean == vec2f(0.0)) {
        return vec3f(0.0);
    }
    let d = ray.direction;
    let aside = max(dot(d.xz, d.xz), 1e-6);
    let y = ray.origin.y - d.y * dot(ray.origin.xz, d.xz) / aside;
    // Heights from the eye; the tree ends a ball's radius above its middle.
    let high = min(y, sprite.reach) - sprite.eye.y;
    return sway_at(high * sprite.half, frame.foot, frame.lean) / sprite.half;
}

@vertex
fn vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32(vertex & 1u), f32(vertex >> 1u));
    // Room for how far its top leans.
    let top = sway_at((sprite.reach - sprite.eye.y) * sprite.half, frame.foot, frame.lean);
    let nearest = max(length(sprite.eye) - sprite.reach, 1e-3) * sprite.half;
    let room = length(top) * select(frame.scale / nearest, frame.scale, frame.parallel != 0u);
    let low = max(sprite.low - room, vec2f(0.0));
    let high = min(sprite.high + room, frame.size);
    let is_there = all(sprite.high > sprite.low);
    return flat_clip(select(sprite.low, mix(low, high, corner), is_there), 0.5);
}

struct Sample {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Sample {
    let at = vec2u(position.xy);
    if !fades_in(sprite.fade, at) {
        discard;
    }
    let still = ray_of(position.xy);
    let shift = sway_of(still);
    let ray = Ray(still.origin - shift, still.direction, still.from_distance);
    let hit = find(ray, at);
    if hit.found != FOUND_HIT {
        discard;
    }
    let place = (still.origin + ray.direction * hit.distance - sprite.eye) * sprite.half;
    let depth = dot(place, frame.forward);
    if is_behind(depth) {
        discard;
    }
    // On the side that is seen: views a few degrees off may see the other.
    let normal = select(hit.normal, -hit.normal, dot(hit.normal, ray.direction) > 0.0);
    let seen = seen_at(place) * on_crown(GAIN_VIEWS);
    let skylit = select(seen.y, hit.sky, sprite.has_sky != 0u);
    var factors = light(normal, seen.x, skylit);
    if frame.relit != 0u && frame.lit != 0u {
        let direct = scattered(dot(to_eye(place), frame.to_sun), frame.translucency) * seen.x;
        factors = mix(factors, frame.sun * direct + frame.sky * skylit, ALL_WAYS);
    }
    let rgb = hit.rgb * factors;
    return Sample(vec4f(rgb, 1.0), depth_value(depth));
}
