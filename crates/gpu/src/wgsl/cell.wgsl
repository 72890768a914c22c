// A cell of a points block as one layer draws it.
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
}
