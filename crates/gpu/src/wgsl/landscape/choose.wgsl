// What to draw of a forest: trees, then cells of those that are near, by forest_points::select.

struct Tiles {
    // First tile and number of tiles of each band; distances at which it begins and ends, as bits.
    bands: array<vec4u, MOST_BANDS>,
    // First tree and number of trees, the nearest tile first.
    tiles: array<vec2u>,
}

struct Run {
    cell: u32,
    first: u32,
    count: u32,
    zero: u32,
}

struct Runs {
    runs: array<Run>,
}

// (The cells of points.wgsl are not used here.)
@group(1) @binding(1) var<storage, read> tiles: Tiles;
// Of each species and size code, points of the block's own tree whose parent is larger.
// Then size codes of triangles. (One buffer: OpenGL binds 16 a stage.)
@group(1) @binding(10) var<storage, read> codes: array<u32>;
@group(1) @binding(11) var<storage, read_write> runs: Runs;

@group(1) @binding(12) var<storage, read_write> boards: Boards;

// A tree each: what is far is drawn at once or put down as one cell, what is near is listed.
@compute @workgroup_size(TILE)
fn cull(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let band = tiles.bands[work.band];
    let number = group.y * groups.x + group.x;
    let tile = tiles.tiles[band.x + min(number, band.y - 1u)];
    if number >= band.y || lane >= tile.y {
        return;
    }
    let index = tile.x + lane;
    let t = tree_of(index);
    let s = species_table[t.species];
    let center = place_of(t, s.center);
    // Wherever the wind bends it.
    let reach = length(lean_of(t, s)) * pow(2.0 * s.tall * t.scale, 2.0);
    let radius = s.radius * t.scale + reach;
    let distance = length(center);
    if distance < bitcast<f32>(band.z) || distance >= bitcast<f32>(band.w) || is_beside(center, radius) {
        return;
    }
    let board = board_of(t, s);
    let asks = board.share < 1.0;
    let share = cylinder_open(center, s.wide * t.scale + reach, s.tall * t.scale, asks);
    if share == 0.0 {
        return;
    }
    if board.share > 0.0 {
        if RUN == 0u {
            put_board(index, distance);
        }
        if board.share >= 1.0 {
            return;
        }
    }
    // Of far trees, what others hide is left out by height.
    let visible = visible_from(t, s);
    if visible.y == 0.0 {
        return;
    }
    if RUN == 0u && board.share == 0.0 {
        atomicAdd(&work.trees, 1u);
    }
    let fade = vec2f(board.share, 1.0);
    let unit = pixels(t, s.block_unit, length(place_of(t, s.origin)));
    let fine = there(code_at_most(finest_seen(share * visible.y) / (unit * unit)), s.least_fine);
    if fine < s.root_parent {
        if RUN == 0u {
            let slot = atomicAdd(&work.near, 1u);
            if slot < arrayLength(&work.trees_near) {
                work.trees_near[slot] = vec2u(index, u32(fine + 1));
            } else {
                atomicAdd(&work.left_out, 1u);
            }
        }
        return;
    }
    let stock = stocks[s.first_cell + s.cells - 1u];
    let count = codes[s.first_code + u32(fine)];
    if count <= land.few {
        if RUN == 0u {
            atomicAdd(&work.points, count);
        }
        splat_few(t, s, stock, fine, count, visible.x, fade);
        return;
    }
    if RUN == 0u {
        atomicAdd(&work.points, count);
        // Nothing stands in for a surfel, however large.
        let cell = put_cell(t, s, stock, fine, i32(MOST_SIZE), visible.x, fade);
        if cell >= 0 {
            put_points(u32(cell), stock.first_point, count);
        }
    }
}

fn put_board(tree: u32, distance: f32) {
    let slot = atomicAdd(&boards.count, 1u);
    let bucket = u32(clamp(log2(distance) * BUCKETS_PER_OCTAVE, 0.0, f32(BUCKETS - 1u)));
    atomicAdd(&boards.buckets[bucket], 1u);
    boards.found[slot] = vec2u(tree, bucket);
    atomicAdd(&work.trees, 1u);
    atomicAdd(&work.impostors, 1u);
}

// Parts of a tree's height that are looked at one by one.
const SLICES = 4u;

// Metres of the way from a place of a tree to the eye that are beside its own crown rather than behind it,
// though the map's texels hold that crown: all of them unless the way rises by half the tree's height on
// them, none where it rises by all of it.
fn own_way(t: Tree, s: Species, place: vec3f) -> f32 {
    let out = s.wide * t.scale + land.sky.texel;
    let aside = max(length(place.xz), 1e-3 * length(place));
    let rise = out * max(-place.y, 0.0) / aside;
    return out * length(place) / aside * clamp(2.0 - rise / (s.tall * t.scale), 0.0, 1.0);
}

// Height from the eye above which some of a tree may be seen, and the largest share that may be.
fn visible_from(t: Tree, s: Species) -> vec2f {
    let middle = place_of(t, s.center);
    let tall = s.tall * t.scale;
    let own = own_way(t, s, middle);
    let slice = 2.0 * tall / f32(SLICES);
    var cut = 3.0e38;
    var most = 0.0;
    for (var k = SLICES; k > 0u; k--) {
        let low = middle.y - tall + slice * f32(k - 1u);
        // Slices by their middles; the uppermost by its upper end, that no tree hides itself.
        let at = low + slice * select(0.5, 1.0, k == SLICES);
        let through = exp(-depth_to_eye(vec3f(middle.x, at, middle.z), own));
        if through >= land.least_seen {
            cut = low;
            most = max(most, through);
        }
    }
    // The lowest part reaches down to the ground, and farther.
    return vec2f(select(cut, -3.0e38, cut <= middle.y - tall), most);
}

// Radius in pixels of a disc of one pixel.
const LEAST_RADIUS = 0.5642;

// A few points, at once. What is smaller than a pixel is as likely to be seen as it would cover its
// middle: it is drawn a pixel large, and as much less opaque.
fn splat_few(t: Tree, s: Species, stock: Stock, fine: i32, count: u32, cut: f32, fade: vec2f) {
    let cell = Cell(
        place_of(t, stock.origin),
        stock.step * t.scale,
        fine,
        i32(MOST_SIZE),
        fade,
        t.turn,
        s.unit * t.scale,
        s.first_code,
        stock.number,
        0u,
        t.mask,
        s.clump,
        cut,
        t.foot.y,
        lean_of(t, s),
    );
    for (var k = 0u; k < count; k++) {
        let index = stock.first_point + k;
        let p = points[index];
        if !is_drawn(cell, p.w) || is_cut(cell, p) {
            continue;
        }
        var e = ellipse(cell, index, p);
        if is_behind(e.depth) {
            continue;
        }
        let area = e.radius * e.radius * inverseSqrt(1.0 + e.squeeze);
        let share = area / (LEAST_RADIUS * LEAST_RADIUS);
        if share < 1.0 {
            e.radius = LEAST_RADIUS;
            e.squeeze = 0.0;
            e.reach = vec2f(LEAST_RADIUS);
            // At random between two steps: opacities have 255.
            let part = f32(e.opacity) * share;
            let id = point_number(cell, index);
            e.opacity = u32(part + sample_hash(id, vec2u(0u)));
        }
        let box = box_of(e);
        if e.opacity == 0u || box.x > box.z || box.y > box.w {
            continue;
        }
        let color = point_color(cell.turn, cell.clump, index, p, e.center, e.depth).rgb;
        splat_box(e, point_number(cell, index), cell.fade, box, pack_color(color));
    }
}

// How many of `count` points from `first` have a parent larger than `fine`: they come first.
fn points_above(first: u32, count: u32, fine: i32) -> u32 {
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        if i32((points[first + middle].w >> 12u) & 0xfffu) > fine {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

fn triangles_above(first: u32, count: u32, coarse: i32) -> u32 {
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        if i32(codes[first + middle]) > coarse {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

fn put_triangles(s: Species, species: u32, cell: u32, first: u32, count: u32) {
    let needed = (count + RUN_TRIANGLES - 1u) / RUN_TRIANGLES;
    let slot = atomicAdd(&boards.draws[species * 4u + 1u], needed);
    for (var k = 0u; k < needed; k++) {
        if slot + k >= s.runs {
            atomicAdd(&work.left_out, 1u);
            return;
        }
        let skip = k * RUN_TRIANGLES;
        let run = Run(cell, first + skip, min(RUN_TRIANGLES, count - skip), 0u);
        runs.runs[s.first_run + slot + k] = run;
    }
}

// A near tree for each workgroup, its cells by its threads.
@compute @workgroup_size(64)
fn choose(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = group.y * groups.x + group.x;
    if number >= min(atomicLoad(&work.near), arrayLength(&work.trees_near)) {
        return;
    }
    let near = work.trees_near[number];
    let t = tree_of(near.x);
    let s = species_table[t.species];
    let block_fine = i32(near.y) - 1;
    let fade = vec2f(board_of(t, s).share, 1.0);
    for (var i = lane; i < s.cells; i += 64u) {
        let stock = stocks[s.first_cell + i];
        let is_top = stock.is_top != 0u;
        if !is_top && stock.root_parent <= block_fine {
            continue;
        }
        let center = place_of(t, stock.center);
        let radius = stock.radius * t.scale + length(sway_at(center.y, t.foot.y, lean_of(t, s)));
        if is_beside(center, radius) {
            continue;
        }
        var share = ball_open(center, radius);
        if share == 0.0 {
            continue;
        }
        // What trees have before the cell, itself among them. (The paper adds k·Z to the threshold.)
        if exp(-depth_to_eye(center, own_way(t, s, center))) < land.least_seen {
            continue;
        }
        share *= exp(-depth_to_eye(center, 0.0));
        let here = pixels(t, s.block_unit, length(center));
        let finest = finest_seen(share);
        let code = there(code_at_most(finest / (here * here)), s.least_fine);
        let fine = select(min(code, stock.root_parent - 1), block_fine, is_top);
        let largest = there(code_at_most(max(land.largest, finest) / (here * here)), s.least_coarse);
        let coarse = select(i32(MOST_SIZE), largest, s.has_triangles != 0u);
        var count = 0u;
        if fine >= 0 || coarse >= 0 {
            count = points_above(stock.first_point, stock.points, fine);
        }
        let first = stock.first_triangle;
        let triangles = triangles_above(s.first_triangle + first, stock.triangles, coarse);
        if count + triangles == 0u {
            continue;
        }
        let cell = put_cell(t, s, stock, fine, coarse, -3.0e38, fade);
        if cell < 0 {
            continue;
        }
        atomicAdd(&work.points, count);
        atomicAdd(&work.triangles, triangles);
        if count > 0u {
            put_points(u32(cell), stock.first_point, count);
        }
        if triangles > 0u {
            put_triangles(s, t.species, u32(cell), first, triangles);
        }
    }
}
