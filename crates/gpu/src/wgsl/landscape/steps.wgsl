// The steps between: counters, and the arguments of indirect dispatches.

struct Counters {
    band: u32,
    near: u32,
    chunks: u32,
    cells: u32,
}

struct Arguments {
    choose: vec4u,
    splat: vec4u,
}

@group(0) @binding(0) var<storage, read_write> counters: Counters;
@group(0) @binding(1) var<storage, read_write> arguments: Arguments;

const MOST_ACROSS = 65535u;

fn dispatch(count: u32) -> vec4u {
    let across = min(count, MOST_ACROSS);
    return vec4u(across, (count + MOST_ACROSS - 1u) / MOST_ACROSS, 1u, 0u);
}

@compute @workgroup_size(1)
fn after_cull() {
    arguments.choose = dispatch(counters.near);
}

@compute @workgroup_size(1)
fn after_choose() {
    arguments.splat = dispatch(counters.chunks);
}

@compute @workgroup_size(1)
fn next_band() {
    counters.band += 1u;
    counters.near = 0u;
    counters.chunks = 0u;
}
