// What the shaders that choose share: their tables, and what may be left out of a picture.

struct Work {
    // Which part of the tiles is looked at.
    band: u32,
    near: atomic<u32>,
    chunks: atomic<u32>,
    cells: atomic<u32>,
    // Counted for people: trees drawn, points and triangles looked at, and what found no room.
    trees: atomic<u32>,
    points: atomic<u32>,
    triangles: atomic<u32>,
    left_out: atomic<u32>,
    // Trees and cells that ask for more than their pruned packs have.
    beyond: atomic<u32>,
    // Trees that are drawn by views.
    impostors: atomic<u32>,
    zero0: u32,
    zero1: u32,
    // Trees whose cells are chosen one by one, and largest size codes of their blocks' own trees.
    trees_near: array<vec2u>,
}

@group(1) @binding(3) var<storage, read> instances: array<vec4u>;
@group(1) @binding(4) var<storage, read> species_table: array<Species>;
@group(1) @binding(5) var<storage, read> stocks: array<Stock>;
@group(1) @binding(6) var<storage, read_write> work: Work;
@group(1) @binding(7) var<storage, read_write> cells_out: array<Cell>;
@group(1) @binding(8) var<storage, read_write> chunks_out: array<Chunk>;
@group(1) @binding(9) var<storage, read> nearness: Nearness;

// Whether a ball is behind the eye, or all of it beside the picture.
fn is_beside(center: vec3f, radius: f32) -> bool {
    let depth = dot(center, frame.forward);
    let half = 0.5 * frame.size / frame.scale;
    let off = abs(vec2f(dot(center, frame.right), dot(center, frame.down)));
    let reach = radius * sqrt(1.0 + half * half);
    return depth < -radius || any(off > half * depth + reach);
}

// Estimated share of a ball that is not behind what nearer bands drew; 0 if it surely is.
fn ball_open(center: vec3f, radius: f32) -> f32 {
    let depth = dot(center, frame.forward) - radius;
    if depth <= frame.near {
        return 1.0;
    }
    let scale = frame.scale / depth;
    let reach = radius * scale;
    let at = 0.5 * frame.size
        + vec2f(dot(center, frame.right), dot(center, frame.down)) * (frame.scale / (depth + radius));
    // The picture of the ball's middle is that of its depth; of its nearest part it is farther out.
    let stretch = abs(at - 0.5 * frame.size) * (radius / depth);
    let low = clamp(at - reach - stretch, vec2f(0.0), frame.size - 1.0);
    let high = clamp(at + reach + stretch, vec2f(0.0), frame.size - 1.0);
    if is_covered(vec2u(low), vec2u(high), depth_value(depth)) {
        return 0.0;
    }
    return open_share(vec2u(low), vec2u(high), depth_value(depth + radius));
}

// The same of an upright cylinder: trees are taller than they are wide. Where no one asks for the share,
// 1 for what may be seen.
fn cylinder_open(center: vec3f, wide: f32, tall: f32, asks: bool) -> f32 {
    let depth = dot(center, frame.forward);
    let up = -frame.down.y * tall;
    // How far the cylinder reaches along the axes of the picture, and into it.
    let reach = vec2f(wide, wide * sqrt(max(1.0 - frame.down.y * frame.down.y, 0.0)) + abs(up));
    let thick = abs(frame.forward.y) * tall + wide * sqrt(max(1.0 - frame.forward.y * frame.forward.y, 0.0));
    let near = depth - thick;
    if near <= frame.near {
        return 1.0;
    }
    let off = vec2f(dot(center, frame.right), dot(center, frame.down));
    // Of a box that is seen, the corners farthest out are nearest to the eye or farthest from it.
    let low = min((off - reach) / near, (off - reach) / (depth + thick)) * frame.scale;
    let high = max((off + reach) / near, (off + reach) / (depth + thick)) * frame.scale;
    let a = vec2u(clamp(0.5 * frame.size + low, vec2f(0.0), frame.size - 1.0));
    let b = vec2u(clamp(0.5 * frame.size + high, vec2f(0.0), frame.size - 1.0));
    if is_covered(a, b, depth_value(near)) {
        return 0.0;
    }
    if !asks {
        return 1.0;
    }
    return open_share(a, b, depth_value(depth));
}

// What thresholds are raised by where only a share is seen. The error that is seen is the share times
// that of the points, which grows about as the root of their area, and their number falls with it:
// the sum of errors for a number of points is least if area grows as the share to the power −2/3.
fn finest_seen(share: f32) -> f32 {
    return land.finest * pow(max(share, LEAST_SHARE), -land.hidden);
}

// The largest size code whose area is at most `area` of square block units; −1 for none:
// forest_points::SizeCode::at_most.
fn code_at_most(area: f32) -> i32 {
    let position = f32(MOST_SIZE + 1u) - (SIZE_TOP - log2(area)) * SIZES_PER_OCTAVE;
    return i32(clamp(floor(position), -1.0, f32(MOST_SIZE)));
}

// A code that is not below what a pruned pack has.
fn there(code: i32, least: i32) -> i32 {
    if code < least && RUN == 0u {
        atomicAdd(&work.beyond, 1u);
    }
    return max(code, least);
}

// The cell of a tree as it is drawn above height `cut` from the eye; -1 if there is no room.
fn put_cell(t: Tree, s: Species, stock: Stock, fine: i32, coarse: i32, cut: f32, fade: vec2f) -> i32 {
    let slot = atomicAdd(&work.cells, 1u);
    if slot >= arrayLength(&cells_out) {
        atomicAdd(&work.left_out, 1u);
        return -1;
    }
    cells_out[slot] = Cell(
        place_of(t, stock.origin),
        stock.step * t.scale,
        fine,
        coarse,
        fade,
        t.turn,
        s.unit * t.scale,
        s.first_code,
        stock.number,
        stock.triangle_number,
        t.mask,
        s.clump,
        cut,
        t.foot.y,
        lean_of(t, s),
    );
    return i32(slot);
}

fn put_points(cell: u32, first: u32, count: u32) {
    let chunks = (count + CHUNK - 1u) / CHUNK;
    let slot = atomicAdd(&work.chunks, chunks);
    for (var k = 0u; k < chunks; k++) {
        if slot + k >= arrayLength(&chunks_out) {
            atomicAdd(&work.left_out, 1u);
            return;
        }
        let skip = k * CHUNK;
        chunks_out[slot + k] = Chunk(cell, first + skip, min(CHUNK, count - skip), 0u);
    }
}
