// One 64-bit atomic operation a sample.

@group(2) @binding(0) var<storage, read_write> kept: array<atomic<u64>>;

// There is one run.
override RUN: u32 = 0u;

fn keep(sample: u32, value: u32, payload: u32) {
    atomicMax(&kept[sample], (u64(value) << 32u) | u64(payload));
}
