// A cell of a points block as one layer, or one instance, draws it.
struct Cell {
    // Of the cell's zero, from the eye.
    origin: vec3f,
    // World units of a position step.
    step: f32,
    // Largest size codes that are drawn of clusters and of surfels.
    fine: i32,
    coarse: i32,
    // Share of the samples.
    fade: vec2f,
    // Cosine and sine of the angle that it is turned by about the vertical.
    turn: vec2f,
    // World units of a unit of radii, and the first of its radii.
    size: f32,
    radii: u32,
    // Numbers of points and triangles for the hash rule: what is added to their indices, and what
    // tells instances apart.
    first_point: u32,
    first_triangle: u32,
    mask: u32,
    // Optical depth before each leaf, for all light.
    clump: f32,
    // Height from the eye below which nothing is drawn.
    cut: f32,
    // Height of its tree's foot from the eye, and how the tree leans.
    foot: f32,
    lean: vec2f,
}

// A vector of the block in the world.
fn turned(turn: vec2f, v: vec3f) -> vec3f {
    return vec3f(turn.x * v.x + turn.y * v.z, v.y, turn.x * v.z - turn.y * v.x);
}

fn place_in(cell: Cell, steps: vec3u) -> vec3f {
    let place = cell.origin + turned(cell.turn, vec3f(steps) * cell.step);
    return place + sway_at(place.y, cell.foot, cell.lean);
}

fn point_number(cell: Cell, index: u32) -> u32 {
    return (index + cell.first_point) ^ cell.mask;
}
