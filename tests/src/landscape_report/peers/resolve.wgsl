// Samples to pixels.

@group(0) @binding(0) var samples: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2i(position.xy) * SAMPLES;
    var sum = vec4f(0.0);
    for (var y = 0; y < SAMPLES; y++) {
        for (var x = 0; x < SAMPLES; x++) {
            sum += textureLoad(samples, at + vec2i(x, y), 0);
        }
    }
    return sum / f32(SAMPLES * SAMPLES);
}
