// Makes `Nearness` of the samples that were kept so far.

struct NearnessOut {
    levels: array<vec4u, MOST_NEARNESS>,
    values: array<f32>,
}

// Payload and depth value of each sample.
@group(1) @binding(0) var<storage, read> found: array<vec2u>;
@group(1) @binding(1) var<storage, read_write> nearness: NearnessOut;

// A block of samples each.
@compute @workgroup_size(8, 8)
fn blocks(@builtin(global_invocation_id) at: vec3u) {
    let l = nearness.levels[0];
    if at.x >= l.x || at.y >= l.y {
        return;
    }
    let size = vec2u(frame.size);
    var least = 0xffffffffu;
    let end = min((at.xy + 1u) * BLOCK, size);
    for (var y = at.y * BLOCK; y < end.y; y++) {
        for (var x = at.x * BLOCK; x < end.x; x++) {
            // Of values that are not negative the bits are in their order.
            least = min(least, found[y * size.x + x].y);
        }
    }
    nearness.values[l.z + at.y * l.x + at.x] = bitcast<f32>(least);
    // Two by two probes a block, off the middles of their squares.
    let probes = nearness.levels[MOST_NEARNESS - 1u];
    let off = array(vec2u(1u, 2u), vec2u(2u, 1u), vec2u(2u, 2u), vec2u(1u, 1u));
    for (var k = 0u; k < 4u; k++) {
        let probe = at.xy * 2u + vec2u(k & 1u, k >> 1u);
        let sample = min(probe * PROBE + off[k], size - 1u);
        if all(probe < probes.xy) {
            let value = found[sample.y * size.x + sample.x].y;
            nearness.values[probes.z + probe.y * probes.x + probe.x] = bitcast<f32>(value);
        }
    }
}

// The coarser levels, one after the other, by one workgroup.
@compute @workgroup_size(256)
fn levels(@builtin(local_invocation_index) lane: u32) {
    for (var level = 1u; level < MOST_NEARNESS - 1u; level++) {
        storageBarrier();
        let from_level = nearness.levels[level - 1u];
        let l = nearness.levels[level];
        let count = l.x * l.y;
        for (var i = lane; i < count; i += 256u) {
            let at = vec2u(i % l.x, i / l.x) * 2u;
            let end = min(at + 2u, from_level.xy);
            var least = 3.0e38;
            for (var y = at.y; y < end.y; y++) {
                for (var x = at.x; x < end.x; x++) {
                    least = min(least, nearness.values[from_level.z + y * from_level.x + x]);
                }
            }
            nearness.values[l.z + i] = least;
        }
    }
}
