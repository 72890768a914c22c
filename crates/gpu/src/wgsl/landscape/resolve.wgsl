// The samples of a forest's small points, and the sky where there is nothing.

// Colour and depth value of the nearest small point of each sample.
@group(1) @binding(0) var<storage, read> found: array<vec2u>;

@vertex
fn vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    // A triangle about the picture.
    return vec4f(f32(vertex & 1u) * 4.0 - 1.0, f32(vertex >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

struct Sample {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Sample {
    let at = vec2u(position.xy);
    let best = found[at.y * u32(frame.size.x) + at.x];
    if best.x != 0u {
        return Sample(vec4f(unpack_color(best.x), 1.0), bitcast<f32>(best.y));
    }
    if best.y != 0u {
        // The ground, which is there already.
        discard;
    }
    // forest_scene::Sky::color.
    let up = normalize(unproject(position.xy, 1.0)).y;
    return Sample(vec4f(mix(land.horizon, land.zenith, sqrt(max(up, 0.0))), 1.0), 0.0);
}
