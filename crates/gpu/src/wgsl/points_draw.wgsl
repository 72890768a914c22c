// What the compute shader left: large points as quads, and the samples of the small ones.

struct LargeList {
    // Arguments of the indirect draw.
    arguments: vec4u,
    points: array<vec2u>,
}

@group(1) @binding(3) var<storage, read> list: LargeList;
// Number (its complement) and depth value of the nearest small point of each sample; 0 for none.
@group(2) @binding(0) var<storage, read> found: array<vec2u>;

struct Quad {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) place: vec2u,
}

@vertex
fn large_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Quad {
    var out: Quad;
    if instance >= arrayLength(&list.points) {
        return out;
    }
    out.place = list.points[instance];
    let e = ellipse(cells[out.place.y], points[out.place.x]);
    let corner = vec2f(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
    out.position = flat_clip(e.center + corner * e.reach, depth_value(e.depth));
    return out;
}

@fragment
fn large_fragment(in: Quad) -> @location(0) vec4f {
    let cell = cells[in.place.y];
    let p = points[in.place.x];
    let e = ellipse(cell, p);
    let at = vec2u(in.position.xy);
    if !(contains(e, in.position.xy) && covers(in.place.x, at, e.opacity) && fades_in(cell.fade, at)) {
        discard;
    }
    return point_color(p, in.position.xy, e.depth);
}

@vertex
fn full_vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    // A triangle about the picture.
    return vec4f(f32(vertex & 1u) * 4.0 - 1.0, f32(vertex >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

struct Sample {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn small_fragment(@builtin(position) position: vec4f) -> Sample {
    let at = vec2u(position.xy);
    let best = found[at.y * u32(frame.size.x) + at.x];
    if best.y == 0u {
        discard;
    }
    let value = bitcast<f32>(best.y);
    return Sample(point_color(points[~best.x], position.xy, depth_of(value)), value);
}
