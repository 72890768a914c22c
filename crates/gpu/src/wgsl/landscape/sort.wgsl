// Puts impostors in order, the nearest first: what is hidden need not be lit.

struct Draw {
    vertices: u32,
    instances: u32,
    zero0: u32,
    zero1: u32,
}

@group(0) @binding(0) var<storage, read_write> boards: Boards;
@group(0) @binding(1) var<storage, read_write> sorted: array<u32>;
@group(0) @binding(2) var<storage, read_write> draw: Draw;

const LANES = 256u;
const EACH = BUCKETS / LANES;

var<workgroup> sums: array<u32, LANES>;

// Makes of the number of each bucket its first place.
@compute @workgroup_size(LANES)
fn places(@builtin(local_invocation_index) lane: u32) {
    var own = 0u;
    for (var k = 0u; k < EACH; k++) {
        own += atomicLoad(&boards.buckets[lane * EACH + k]);
    }
    sums[lane] = own;
    for (var step = 1u; step < LANES; step *= 2u) {
        workgroupBarrier();
        var before = 0u;
        if lane >= step {
            before = sums[lane - step];
        }
        workgroupBarrier();
        sums[lane] += before;
    }
    var first = sums[lane] - own;
    for (var k = 0u; k < EACH; k++) {
        let count = atomicExchange(&boards.buckets[lane * EACH + k], first);
        first += count;
    }
    if lane == LANES - 1u {
        draw = Draw(4u, first, 0u, 0u);
    }
}

@compute @workgroup_size(LANES)
fn sort(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = (group.y * groups.x + group.x) * LANES + lane;
    if index < min(atomicLoad(&boards.count), arrayLength(&boards.found)) {
        let found = boards.found[index];
        sorted[atomicAdd(&boards.buckets[found.y], 1u)] = found.x;
    }
}
