// The sky, where there is nothing.

struct Out {
    @builtin(position) position: vec4f,
    @location(0) at: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Out {
    let at = vec2f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return Out(vec4f(at, 0.0, 1.0), at);
}

@fragment
fn fragment(in: Out) -> @location(0) vec4f {
    let toward = view.forward + view.right * (in.at.x / view.wide) + view.up * (in.at.y / view.tall);
    let up = normalize(toward).y;
    return vec4f(mix(view.horizon, view.zenith, sqrt(max(up, 0.0))), 1.0);
}
