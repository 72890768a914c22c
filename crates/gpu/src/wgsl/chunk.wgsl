// What the compute shader of points works on, and what it leaves to others.

struct Chunk {
    cell: u32,
    first: u32,
    count: u32,
    // Keeps 16 bytes.
    zero: u32,
}

struct Large {
    // Arguments of an indirect draw.
    vertices: u32,
    instances: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
    // Index of point and cell.
    points: array<vec2u>,
}
