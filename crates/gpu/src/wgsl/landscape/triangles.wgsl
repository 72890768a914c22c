// The triangles of many trees of a kind: an instance is a run of them in a cell.

struct Run {
    cell: u32,
    first: u32,
    count: u32,
    zero: u32,
}

@group(1) @binding(6) var<storage, read> runs: array<Run>;

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Corner {
    var none: Corner;
    if instance >= arrayLength(&runs) {
        return none;
    }
    let run = runs[instance];
    if index / 3u >= run.count {
        return none;
    }
    return corner(3u * run.first + index, run.cell);
}
