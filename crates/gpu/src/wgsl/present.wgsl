// The finished picture: samples averaged to pixels, on a grey or with straight alpha. The target is
// an sRGB format and encodes what it is given.

struct Present {
    // Samples along a side of a pixel.
    side: u32,
    // 1 for straight alpha.
    alpha: u32,
    // Linear grey behind the tree.
    background: f32,
    // Pixels from the left that the tree is drawn from: what is left of it is the other picture's.
    split: f32,
}

@group(0) @binding(0) var samples: texture_2d<f32>;
@group(0) @binding(1) var<uniform> present: Present;
// A picture to compare with, of the same size in pixels or 1 × 1 for none: premultiplied.
@group(0) @binding(2) var other: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return vec4f(f32(vertex & 1u) * 4.0 - 1.0, f32(vertex >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2i(position.xy);
    if abs(position.x - present.split) < 1.0 && present.split > 0.0 {
        return vec4f(1.0);
    }
    var sum = vec4f(0.0);
    if position.x < present.split {
        sum = textureLoad(other, min(at, vec2i(textureDimensions(other)) - 1), 0);
    } else {
        let side = i32(present.side);
        for (var y = 0; y < side; y++) {
            for (var x = 0; x < side; x++) {
                sum += textureLoad(samples, at * side + vec2i(x, y), 0);
            }
        }
        sum /= f32(side * side);
    }
    if present.alpha != 0u {
        return vec4f(select(vec3f(0.0), sum.rgb / sum.a, sum.a > 0.0), sum.a);
    }
    return vec4f(sum.rgb + present.background * (1.0 - sum.a), 1.0);
}
