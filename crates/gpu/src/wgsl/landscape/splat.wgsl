// The compute shader of the small points of a forest: as that of a block, but what is kept of a point is
// its colour, and what nearer bands cover is left out.

struct WorkRead {
    band: u32,
    near: u32,
    chunks: u32,
}

@group(1) @binding(3) var<storage, read> chunks: array<Chunk>;
@group(1) @binding(5) var<storage, read> work: WorkRead;
@group(1) @binding(6) var<storage, read> nearness: Nearness;

@compute @workgroup_size(CHUNK)
fn splat(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = group.y * groups.x + group.x;
    if number >= min(work.chunks, arrayLength(&chunks)) {
        return;
    }
    let chunk = chunks[number];
    if lane >= chunk.count {
        return;
    }
    let index = chunk.first + lane;
    let p = points[index];
    let cell = cells[chunk.cell];
    if !is_drawn(cell, p.w) || is_cut(cell, p) {
        return;
    }
    let e = ellipse(cell, index, p);
    if is_behind(e.depth) {
        return;
    }
    let box = box_of(e);
    if box.x > box.z || box.y > box.w {
        return;
    }
    if is_covered(vec2u(box.xy), vec2u(box.zw), depth_value(e.depth)) {
        return;
    }
    let n = box.zw - box.xy + 1;
    if u32(n.x * n.y) > SPLAT_MOST && listed(index, chunk.cell) {
        return;
    }
    let color = point_color(cell.turn, cell.clump, index, p, e.center, e.depth).rgb;
    splat_box(e, point_number(cell, index), cell.fade, box, pack_color(color));
}
