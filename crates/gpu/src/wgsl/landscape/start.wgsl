// Between ground, points and what is drawn after them.

@group(1) @binding(0) var<storage, read_write> samples: array<vec2u>;
@group(1) @binding(1) var ground_depth: texture_2d<f32>;

// Starts the samples of points with the depth of the ground, and no colour.
@compute @workgroup_size(8, 8)
fn start(@builtin(global_invocation_id) at: vec3u) {
    let size = vec2u(frame.size);
    if any(at.xy >= size) {
        return;
    }
    let value = textureLoad(ground_depth, at.xy, 0).x;
    samples[at.y * size.x + at.x] = vec2u(0u, bitcast<u32>(value));
}
