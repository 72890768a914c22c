// Trees that are drawn as impostors, as they are found; and the draws of triangles.

struct Boards {
    count: atomic<u32>,
    zero0: u32,
    zero1: u32,
    zero2: u32,
    // How many there are by distance; then where those of each bucket go.
    buckets: array<atomic<u32>, BUCKETS>,
    // Of each species, the arguments of its draw of triangles: vertices, runs, zeros.
    draws: array<atomic<u32>, MOST_DRAWS>,
    // Tree and bucket.
    found: array<vec2u>,
}
