// The compute shader of the small points of a block. The complement of a point's index is kept: of
// equal depths the first point wins.

@group(1) @binding(3) var<storage, read> chunks: array<Chunk>;

@compute @workgroup_size(CHUNK)
fn splat(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let chunk = chunks[group.y * groups.x + group.x];
    if lane >= chunk.count {
        return;
    }
    let index = chunk.first + lane;
    let p = points[index];
    let cell = cells[chunk.cell];
    if !is_drawn(cell, p.w) {
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
    let n = box.zw - box.xy + 1;
    // Large points that find a place in the list are drawn as quads.
    if u32(n.x * n.y) > SPLAT_MOST && listed(index, chunk.cell) {
        return;
    }
    splat_box(e, point_number(cell, index), cell.fade, box, ~index);
}
