// The triangles of a block: an instance is a cell.

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) cell: u32) -> Corner {
    return corner(index, cell);
}
