// A run of points of a cell: what a workgroup of the compute shader of points works on.
struct Chunk {
    cell: u32,
    first: u32,
    count: u32,
    // Keeps 16 bytes.
    zero: u32,
}
