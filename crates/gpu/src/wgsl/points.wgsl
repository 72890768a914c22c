// Points: each covers an ellipse (forest_points::spheroid). Small ones are splatted by a compute
// shader, with one atomic operation a sample, after M. Schütz, B. Kerbl, M. Wimmer, "Software
// rasterization of 2 billion points in real time" (2022); large ones are drawn as quads.

@group(1) @binding(0) var<storage, read> points: array<vec4u>;
@group(1) @binding(1) var<storage, read> cells: array<Cell>;
// World radius of each size code.
@group(1) @binding(2) var<storage, read> radii: array<f32>;

struct Ellipse {
    // Middle in pixels, and half the box around it.
    center: vec2f,
    reach: vec2f,
    minor: vec2f,
    // 1/ratio² − 1.
    squeeze: f32,
    radius: f32,
    depth: f32,
    opacity: u32,
}

fn is_drawn(cell: Cell, bits: u32) -> bool {
    let own = i32(bits & 0xfffu);
    return own <= select(cell.fine, cell.coarse, (bits >> 31u) != 0u);
}

fn point_axis(turn: vec2f, p: vec4u) -> vec3f {
    return turned(turn, decode_axis(vec2u((p.y >> 16u) & 0xffu, p.y >> 24u)));
}

// Whether a point lies below what is drawn of its cell. (Turning does not change heights.)
fn is_cut(cell: Cell, p: vec4u) -> bool {
    return cell.origin.y + f32(p.x >> 16u) * cell.step < cell.cut;
}

// Of point number `index` of the array.
fn ellipse(cell: Cell, index: u32, p: vec4u) -> Ellipse {
    let place = bent(index, place_in(cell, vec3u(p.x & 0xffffu, p.x >> 16u, p.y & 0xffffu)));
    let at = project(place);
    let axis = bent_axis(index, point_axis(cell.turn, p));
    var e: Ellipse;
    e.center = at.xy;
    e.depth = at.z;
    let radius = radii[cell.radii + (p.w & 0xfffu)] * cell.size;
    e.radius = radius * select(frame.scale / at.z, frame.scale, frame.parallel != 0u);
    let flat = f32((p.w >> 24u) & 0x7fu) / FLATNESS_STEPS;
    let c = dot(axis, to_eye(place));
    let c2 = min(c * c, 1.0);
    let ratio = max(sqrt(c2 + flat * flat * (1.0 - c2)), THINNEST);
    let toward = vec2f(dot(axis, frame.right), dot(axis, frame.down));
    let l = length(toward);
    e.minor = select(vec2f(1.0, 0.0), toward / l, l > 0.0);
    e.squeeze = 1.0 / (ratio * ratio) - 1.0;
    e.reach = e.radius * sqrt(max(1.0 - e.minor * e.minor * (1.0 - ratio * ratio), vec2f(0.0)));
    e.opacity = p.z >> 24u;
    return e;
}

fn contains(e: Ellipse, at: vec2f) -> bool {
    let d = at - e.center;
    let along = dot(d, e.minor);
    return dot(d, d) + along * along * e.squeeze <= e.radius * e.radius;
}

// Lit colour of a point that is turned by `turn` and is seen at `at` in depth `depth`.
fn point_color(turn: vec2f, clump: f32, index: u32, p: vec4u, at: vec2f, depth: f32) -> vec4f {
    let rgb = srgb_to_linear(vec3f(vec3u(p.z & 0xffu, (p.z >> 8u) & 0xffu, (p.z >> 16u) & 0xffu)) / 255.0);
    let place = unproject(at, depth);
    let axis = bent_axis(index, point_axis(turn, p));
    let normal = select(axis, -axis, dot(axis, to_eye(place)) < 0.0);
    let seen = seen_at(place) * (exp(-clump) * on_crown(GAIN_POINTS));
    return vec4f(rgb * light(normal, seen.x, seen.y * skyward(normal)), 1.0);
}
