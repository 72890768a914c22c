// The list of points that are too large for the compute shader.

struct Large {
    // Arguments of an indirect draw.
    vertices: u32,
    instances: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
    // Index of point and cell.
    points: array<vec2u>,
}

@group(1) @binding(4) var<storage, read_write> large: Large;

// Whether a point is in the list, or as good as that.
fn listed(index: u32, cell: u32) -> bool {
    if RUN != 0u {
        // The second run without 64-bit atomics. If some did not find a place, all are filled again.
        // Those that did change nothing, unless they lie in the very depth that was kept, and are as good.
        return atomicLoad(&large.instances) <= arrayLength(&large.points);
    }
    let slot = atomicAdd(&large.instances, 1u);
    if slot < arrayLength(&large.points) {
        large.points[slot] = vec2u(index, cell);
        return true;
    }
    return false;
}
