// The compute shader of small points. Of every sample the nearest point is kept: the upper word is
// its depth value, the lower one the complement of its number (of equal depths the first wins).

// Pixels of the largest box that is filled here.
override SPLAT_MOST: u32 = 256u;

struct Chunk {
    cell: u32,
    first: u32,
    count: u32,
    // Keeps 16 bytes.
    zero: u32,
}

@group(1) @binding(3) var<storage, read> chunks: array<Chunk>;

struct Large {
    // Arguments of an indirect draw.
    vertices: u32,
    instances: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
    // Number of point and cell.
    points: array<vec2u>,
}

@group(1) @binding(4) var<storage, read_write> large: Large;

fn splat_box(e: Ellipse, id: u32, fade: vec2f, from_pixel: vec2i, to_pixel: vec2i) {
    let value = bitcast<u32>(depth_value(e.depth));
    for (var y = from_pixel.y; y <= to_pixel.y; y++) {
        for (var x = from_pixel.x; x <= to_pixel.x; x++) {
            let at = vec2u(vec2i(x, y));
            if contains(e, vec2f(at) + 0.5) && covers(id, at, e.opacity) && fades_in(fade, at) {
                keep(at.y * u32(frame.size.x) + at.x, value, ~id);
            }
        }
    }
}

@compute @workgroup_size(CHUNK)
fn splat(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = group.y * groups.x + group.x;
    let chunk = chunks[number];
    if lane >= chunk.count {
        return;
    }
    let id = chunk.first + lane;
    let p = points[id];
    let cell = cells[chunk.cell];
    if !is_drawn(cell, p.w) {
        return;
    }
    let e = ellipse(cell, p);
    if is_behind(e.depth) {
        return;
    }
    // Pixels whose middle may lie inside. What reaches out of the picture is cut before it becomes
    // an integer.
    let low = clamp(ceil(e.center - e.reach - 0.5), vec2f(0.0), frame.size);
    let high = clamp(floor(e.center + e.reach - 0.5), vec2f(-1.0), frame.size - 1.0);
    let a = vec2i(low);
    let b = vec2i(high);
    if a.x > b.x || a.y > b.y {
        return;
    }
    let n = b - a + 1;
    if u32(n.x * n.y) > SPLAT_MOST {
        large_point(e, id, chunk.cell, cell.fade, a, b);
        return;
    }
    splat_box(e, id, cell.fade, a, b);
}
