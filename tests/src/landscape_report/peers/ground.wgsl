// The ground: patches of forest_scene::Ground, as landscape/ground.wgsl draws them; and the sky.

struct Grid {
    points: vec2u,
    cell: vec2f,
}

struct Patch {
    corner: vec2u,
    stride: u32,
    skirt: f32,
}

@group(1) @binding(0) var<storage, read> patches: array<Patch>;
@group(1) @binding(1) var<storage, read> vertices: array<u32>;
@group(1) @binding(2) var<uniform> grid: Grid;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) place: vec3f,
    @location(1) normal: vec3f,
    @location(2) color: vec3f,
}

const SIDE = PATCH + 2u;

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Corner {
    let patch_here = patches[instance];
    let quad = index / 6u;
    var part = array(vec2u(0u, 0u), vec2u(1u, 1u), vec2u(1u, 0u), vec2u(0u, 0u), vec2u(0u, 1u), vec2u(1u, 1u));
    let at = vec2u(quad % SIDE, quad / SIDE) + part[index % 6u];
    let inner = clamp(at, vec2u(1u), vec2u(PATCH + 1u)) - 1u;
    let is_skirt = any(at == vec2u(0u)) || any(at == vec2u(PATCH + 2u));
    let point = min(patch_here.corner + inner * patch_here.stride, grid.points - 1u);
    let first = (point.y * grid.points.x + point.x) * 3u;
    let xz = vec2f(point) * grid.cell - 0.5 * vec2f(grid.points - 1u) * grid.cell;
    let y = bitcast<f32>(vertices[first]) - select(0.0, patch_here.skirt, is_skirt);
    var out: Corner;
    out.place = from_eye(vec3f(xz.x, y, xz.y));
    out.position = clip(out.place);
    out.color = srgb_to_linear(unpack4x8unorm(vertices[first + 1u]).rgb);
    let normal = vertices[first + 2u];
    out.normal = decode_axis(vec2u(normal & 0xffu, (normal >> 8u) & 0xffu));
    return out;
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4f {
    return vec4f(in.color * light(normalize(in.normal), seen_smoothly(in.place)), 1.0);
}
