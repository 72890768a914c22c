// One 64-bit atomic operation a sample.

@group(2) @binding(0) var<storage, read_write> kept: array<atomic<u64>>;

fn keep(sample: u32, value: u32, id: u32) {
    atomicMax(&kept[sample], (u64(value) << 32u) | u64(id));
}

fn large_point(e: Ellipse, id: u32, cell: u32, fade: vec2f, a: vec2i, b: vec2i) {
    let slot = atomicAdd(&large.instances, 1u);
    if slot < arrayLength(&large.points) {
        large.points[slot] = vec2u(id, cell);
    } else {
        splat_box(e, id, fade, a, b);
    }
}
