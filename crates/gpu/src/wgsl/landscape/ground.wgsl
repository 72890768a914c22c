// The ground: patches of a quadtree (forest_scene::Ground).

struct Grid {
    // Points along x and z.
    points: vec2u,
    // Metres of a cell.
    cell: vec2f,
}

struct Patch {
    corner: vec2u,
    stride: u32,
    skirt: f32,
}

@group(1) @binding(0) var<storage, read> patches: array<Patch>;
// Height, colour and normal of each point: three words.
@group(1) @binding(1) var<storage, read> vertices: array<u32>;
@group(1) @binding(2) var<uniform> grid: Grid;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) place: vec3f,
    @location(1) normal: vec3f,
    @location(2) color: vec3f,
}

// Quads along a side of a patch with its skirt.
const SIDE = PATCH + 2u;

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Corner {
    let patch_here = patches[instance];
    let quad = index / 6u;
    // Two triangles that share the diagonal from the first to the last corner.
    var part = array(vec2u(0u, 0u), vec2u(1u, 1u), vec2u(1u, 0u), vec2u(0u, 0u), vec2u(0u, 1u), vec2u(1u, 1u));
    let at = vec2u(quad % SIDE, quad / SIDE) + part[index % 6u];
    // The outermost vertices are those of the border, drawn down.
    let inner = clamp(at, vec2u(1u), vec2u(PATCH + 1u)) - 1u;
    let is_skirt = any(at == vec2u(0u)) || any(at == vec2u(PATCH + 2u));
    let point = min(patch_here.corner + inner * patch_here.stride, grid.points - 1u);
    let first = (point.y * grid.points.x + point.x) * 3u;
    var place = vec3f(0.0, bitcast<f32>(vertices[first]), 0.0);
    let xz = vec2f(point) * grid.cell - 0.5 * vec2f(grid.points - 1u) * grid.cell;
    place.x = xz.x;
    place.z = xz.y;
    place.y -= select(0.0, patch_here.skirt, is_skirt);
    let off = from_eye(place);
    var out: Corner;
    let along = dot(off, frame.forward);
    let ndc = vec2f(dot(off, frame.right), -dot(off, frame.down)) * frame.scale * 2.0 / frame.size;
    out.position = vec4f(ndc, frame.near, along);
    out.place = off;
    let color = vertices[first + 1u];
    out.color = srgb_to_linear(unpack4x8unorm(color).rgb);
    let normal = vertices[first + 2u];
    out.normal = decode_axis(vec2u(normal & 0xffu, (normal >> 8u) & 0xffu));
    return out;
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4f {
    let normal = normalize(in.normal);
    let seen = seen_smoothly(in.place);
    return vec4f(in.color * light(normal, seen.x, seen.y * skyward(normal)), 1.0);
}
