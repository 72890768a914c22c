// Without 64-bit atomics: two runs, the first for the depths, the second for the numbers of the
// points that have them. The buffer is the same in the end.

@group(2) @binding(0) var<storage, read_write> kept: array<atomic<u32>>;

// 0 for the first run, 1 for the second.
override RUN: u32 = 0u;

fn keep(sample: u32, value: u32, id: u32) {
    if RUN == 0u {
        atomicMax(&kept[2u * sample + 1u], value);
    } else if atomicLoad(&kept[2u * sample + 1u]) == value {
        atomicMax(&kept[2u * sample], id);
    }
}

fn large_point(e: Ellipse, id: u32, cell: u32, fade: vec2f, a: vec2i, b: vec2i) {
    if RUN == 0u {
        let slot = atomicAdd(&large.instances, 1u);
        if slot < arrayLength(&large.points) {
            large.points[slot] = vec2u(id, cell);
        } else {
            splat_box(e, id, fade, a, b);
        }
    } else if atomicLoad(&large.instances) > arrayLength(&large.points) {
        // Some did not find a place in the list. Those that did change nothing here, unless they
        // lie in the very depth that was kept, and are as good.
        splat_box(e, id, fade, a, b);
    }
}
