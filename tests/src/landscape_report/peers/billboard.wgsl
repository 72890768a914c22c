// A quad a tree, that turns about the vertical: the nearest of the baked views.

struct Board {
    half_width: f32,
    bottom: f32,
    height: f32,
    // Metres from the axis of depth codes 0 and 1.
    deep: f32,
    views: f32,
    zero0: f32,
    zero1: f32,
    zero2: f32,
}

@group(1) @binding(0) var<uniform> board: Board;
@group(1) @binding(1) var colors: texture_2d_array<f32>;
// Normals in the frame of the view's camera (right, up, towards it), and depth towards it.
@group(1) @binding(2) var normals: texture_2d_array<f32>;
@group(1) @binding(3) var board_sampler: sampler;

struct Out {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) off: vec3f,
    @location(2) @interpolate(flat) right: vec3f,
    @location(3) @interpolate(flat) layer: u32,
    @location(4) @interpolate(flat) scale: f32,
    @location(5) @interpolate(flat) dark: f32,
}

const TURN = 6.283185307179586;

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Out {
    let tree = trees[list[instance]];
    let foot = from_eye(tree.foot);
    let toward = -normalize(foot.xz + vec2f(1e-6, 0.0));
    // Angles are from +z to +x.
    let angle = atan2(toward.x, toward.y) - tree.yaw;
    let view_number = i32(round(angle / TURN * board.views)) + 4 * i32(board.views);
    let corner = vec2f(f32(index & 1u), f32(index >> 1u));
    var out: Out;
    out.right = vec3f(toward.y, 0.0, -toward.x);
    let across = (2.0 * corner.x - 1.0) * board.half_width;
    let up = board.bottom + (1.0 - corner.y) * board.height;
    out.off = foot + (out.right * across + vec3f(0.0, up, 0.0)) * tree.scale;
    out.position = clip(out.off);
    out.uv = corner;
    out.layer = u32(view_number) % u32(board.views);
    out.scale = tree.scale;
    out.dark = tree.dark;
    return out;
}

@fragment
fn fragment(in: Out) -> @location(0) vec4f {
    let color = textureSample(colors, board_sampler, in.uv, in.layer);
    let code = textureSample(normals, board_sampler, in.uv, in.layer) * 2.0 - 1.0;
    if color.a < 0.5 {
        discard;
    }
    let toward = vec3f(-in.right.z, 0.0, in.right.x);
    let normal = normalize(in.right * code.x + vec3f(0.0, code.y, 0.0) + toward * max(code.z, 0.01));
    let place = in.off + toward * (code.w * board.deep * in.scale);
    return vec4f(color.rgb * light(normal, seen_at(place) * in.dark), 1.0);
}
