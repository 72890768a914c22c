// Large points, as quads.

struct LargeList {
    // Arguments of the indirect draw.
    arguments: vec4u,
    points: array<vec2u>,
}

@group(1) @binding(3) var<storage, read> list: LargeList;

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
    let e = ellipse(cells[out.place.y], out.place.x, points[out.place.x]);
    let corner = vec2f(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
    out.position = flat_clip(e.center + corner * e.reach, depth_value(e.depth));
    return out;
}

@fragment
fn large_fragment(in: Quad) -> @location(0) vec4f {
    let cell = cells[in.place.y];
    let p = points[in.place.x];
    let e = ellipse(cell, in.place.x, p);
    let at = vec2u(in.position.xy);
    let id = point_number(cell, in.place.x);
    if !(contains(e, in.position.xy) && covers(id, at, e.opacity) && fades_in(cell.fade, at)) {
        discard;
    }
    return point_color(cell.turn, cell.clump, in.place.x, p, e.center, e.depth);
}
