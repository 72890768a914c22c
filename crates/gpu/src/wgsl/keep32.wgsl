// Without 64-bit atomics: two runs, the first for the depths, the second for what is known of the
// points that have them. The buffer is the same in the end.

@group(2) @binding(0) var<storage, read_write> kept: array<atomic<u32>>;

// 0 for the first run, 1 for the second.
override RUN: u32 = 0u;

fn keep(sample: u32, value: u32, payload: u32) {
    if RUN == 0u {
        atomicMax(&kept[2u * sample + 1u], value);
    } else if atomicLoad(&kept[2u * sample + 1u]) == value {
        atomicMax(&kept[2u * sample], payload);
    }
}
