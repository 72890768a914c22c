// The samples of small points.

// Index (its complement) and depth value of the nearest small point of each sample; 0 for none.
@group(2) @binding(0) var<storage, read> found: array<vec2u>;

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
    return Sample(point_color(vec2f(1.0, 0.0), 0.0, ~best.x, points[~best.x], position.xy, depth_of(value)), value);
}
