// Trees of a landscape as they stand before the eye. The arrays are each shader's own.

struct Species {
    // Ball about a tree, from its foot, at scale 1.
    center: vec3f,
    radius: f32,
    // Zero of its block, from its foot.
    origin: vec3f,
    // Metres of a block unit.
    block_unit: f32,
    // Least scale, and what is added for each step of it.
    least: f32,
    step: f32,
    // Its cells; the last one is the block's own tree.
    first_cell: u32,
    cells: u32,
    // Its size codes, and its radii.
    first_code: u32,
    // Largest size code of a cell root's parent: from there on the block's own tree is all there is.
    root_parent: i32,
    // 1 if there are triangles.
    has_triangles: u32,
    // Metres of a unit of radii.
    unit: f32,
    // Size codes of its triangles.
    first_triangle: u32,
    // Of a pruned pack, codes below which nothing is there; −1.
    least_fine: i32,
    // Its runs of triangles, and how many there is room for.
    first_run: u32,
    runs: u32,
    // Optical depth that a leaf has before it within its own clump.
    clump: f32,
    // Radius of the upright cylinder about `center` that holds a tree, and half its height.
    wide: f32,
    tall: f32,
    least_coarse: i32,
    // Middle of its views' tiles, from its foot, and their side in metres; 0 without views.
    view_center: vec3f,
    view_side: f32,
    // Texels along the side of a tile at the finest level, and how many pixels large it may be if a pixel
    // may be off by one.
    view_texels: f32,
    view_most: f32,
    // Its levels, frames and compass among those of all species.
    view_levels: u32,
    first_level: u32,
    first_frame: u32,
    first_compass: u32,
    // Displacement of the top in a wind of strength 1 that pushes by 1, in heights.
    limber: f32,
    zero: u32,
}

// A cell of a species, in metres from the foot of a tree of scale 1.
struct Stock {
    origin: vec3f,
    step: f32,
    center: vec3f,
    radius: f32,
    first_point: u32,
    points: u32,
    // What is added to indices of points for their numbers.
    number: u32,
    root_parent: i32,
    // In the species' own array.
    first_triangle: u32,
    triangles: u32,
    is_top: u32,
    // What is added to indices of triangles for their numbers.
    triangle_number: u32,
}

// A tree as it stands before the eye.
struct Tree {
    species: u32,
    // Its foot from the eye.
    foot: vec3f,
    turn: vec2f,
    scale: f32,
    mask: u32,
}

fn tree_of(index: u32) -> Tree {
    let record = instances[index];
    var t: Tree;
    t.species = record.w >> 24u;
    let s = species_table[t.species];
    t.scale = s.least + s.step * f32((record.w >> 12u) & (STEPS - 1u));
    let yaw = f32(record.w & (STEPS - 1u)) * (2.0 * HALF_TURN / f32(STEPS));
    t.turn = vec2f(cos(yaw), sin(yaw));
    t.foot = from_eye(bitcast<vec3f>(record.xyz));
    // Two trees do not share the samples that they cover.
    t.mask = mix_bits(index + 1u);
    return t;
}

fn place_of(t: Tree, off: vec3f) -> vec3f {
    return t.foot + turned(t.turn, off) * t.scale;
}

// Pixels of a block unit at a distance.
fn pixels(t: Tree, block_unit: f32, distance: f32) -> f32 {
    return frame.scale / distance * block_unit * t.scale;
}

// How a tree leans: forest_foliage::Sway::new. Gusts travel over the land.
fn lean_of(t: Tree, s: Species) -> vec2f {
    let strength = length(land.wind.xy);
    if strength <= 0.0 {
        return vec2f(0.0);
    }
    let direction = land.wind.xy / strength;
    let at = t.foot.xz + land.eye.xz;
    let phase = f32(t.mask & 0xffffu) / 65536.0 * OWN_PHASE - dot(at, direction) / GUST;
    var push = vec2f(STEADY, 0.0);
    for (var k = 0u; k < 4u; k++) {
        let turns = land.wind.z * land.wind.w * SWINGS[k].y + phase + SWINGS[k].z;
        push[k >> 1u] += SWINGS[k].x * sin(fract(turns) * 2.0 * HALF_TURN);
    }
    // forest_foliage::Wind: across is along × up.
    let moved = direction * push.x + vec2f(-direction.y, direction.x) * push.y;
    let top = moved * (strength * s.limber);
    return top * min(MOST_LEAN / max(length(top), 1e-6), 1.0) / (2.0 * s.tall * t.scale);
}

struct Board {
    // Of the samples that a tree is drawn by as an impostor.
    share: f32,
    level: u32,
}

// What a tree shows of its views from its distance.
fn board_of(t: Tree, s: Species) -> Board {
    if s.view_side == 0.0 {
        return Board(0.0, 0u);
    }
    // In pixels, as thresholds are areas of samples.
    let pixel = land.pixel;
    let distance = length(place_of(t, s.view_center));
    let metres = s.view_side * t.scale;
    let side = frame.scale / (pixel * distance) * metres;
    let largest = land.impostors * s.view_most * sqrt(land.finest) / pixel;
    // Never about the eye: forest_scene::Impostor::is_within.
    if side < LEAST_IMPOSTOR || side >= largest || distance < metres {
        return Board(0.0, 0u);
    }
    let share = min((1.0 - side / largest) / (1.0 - IMPOSTOR_FADE), 1.0);
    // Texels of a pixel, or the next larger or smaller.
    let level = round(log2(s.view_texels / side));
    return Board(share, u32(clamp(level, 0.0, f32(s.view_levels - 1u))));
}
