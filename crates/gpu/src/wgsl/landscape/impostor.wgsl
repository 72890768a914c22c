// Far trees: a quad each, whose samples are those of three views around the direction to the eye, each
// with its share (forest_views::Lookup::Blend).

struct Level {
    first_tile: u32,
    // 1 if depth is there.
    has_depth: u32,
    // Along the side of a tile.
    texels: f32,
    // Radius of the ball that holds the tree, in units of half a tile.
    reach: f32,
}

@group(1) @binding(0) var<storage, read> instances: array<vec4u>;
@group(1) @binding(1) var<storage, read> species_table: array<Species>;
// The nearest first.
@group(1) @binding(2) var<storage, read> sorted: array<u32>;
@group(1) @binding(3) var<storage, read> levels: array<Level>;
@group(1) @binding(4) var<storage, read> tiles: array<vec4u>;
@group(1) @binding(5) var<storage, read> view_frames: array<ViewFrame>;
// By direction, three views of 16 bits and the shares of the first two of 8.
@group(1) @binding(6) var<storage, read> compass: array<vec2u>;
@group(1) @binding(7) var color_pages: texture_2d_array<f32>;
@group(1) @binding(8) var depth_pages: texture_2d_array<f32>;

struct Corner {
    @builtin(position) position: vec4f,
    // Texel of the whole tile of each view; the views' tiles, and the shares of one and of two of them.
    @location(0) at: vec4f,
    @location(1) at_last: vec2f,
    @location(2) @interpolate(flat) views: vec3u,
    @location(3) @interpolate(flat) shares: vec2f,
    // Place of the tree's middle plane from the eye, and what a height of 1 adds; 0 without depth.
    @location(4) place: vec3f,
    @location(5) @interpolate(flat) rise: vec3f,
    // Light of the sun and of the sky where all of both is seen.
    @location(6) @interpolate(flat) sun: vec3f,
    @location(7) @interpolate(flat) sky: vec3f,
    // Of the hash rule; share of the samples.
    @location(8) @interpolate(flat) mask: u32,
    @location(9) @interpolate(flat) share: f32,
    // What the tree leans for the square of a height, in texels of each view's tile; its foot's height.
    @location(10) @interpolate(flat) lean: vec4f,
    @location(11) @interpolate(flat) lean_last: vec3f,
}

// A displacement in the tree's own frame on a view's tile, in texels.
fn on_tile(v: ViewFrame, d: vec3f, half: f32, texels: f32) -> vec2f {
    return vec2f(dot(d, v.right.xyz), -dot(d, v.up.xyz)) * (0.5 * texels / half);
}

// Where a ray from the eye through `direction` meets a view's tile.
fn tile_at(v: ViewFrame, center: vec3f, direction: vec3f, half: f32) -> vec2f {
    let toward = dot(direction, v.back.xyz);
    let off = direction * (dot(center, v.back.xyz) / min(toward, -0.05)) - center;
    let at = vec2f(dot(off, v.right.xyz), -dot(off, v.up.xyz)) / half;
    return 0.5 * at + 0.5;
}

// First and last place of what a view shows along two axes, from −1 to 1 on the view's tile. (From far
// above, views around the direction to the eye are turned against it and one another.)
fn shown(v: ViewFrame, view: u32, texels: f32, right: vec3f, down: vec3f) -> vec4f {
    let tile = tile_of(view);
    let half = vec2f(tile.size) / texels;
    let middle = vec2f(tile.corner) * (2.0 / texels) - 1.0 + half;
    let x = vec2f(dot(right, v.right.xyz), dot(down, v.right.xyz));
    let y = -vec2f(dot(right, v.up.xyz), dot(down, v.up.xyz));
    let at = x * middle.x + y * middle.y;
    let reach = abs(x) * half.x + abs(y) * half.y;
    return vec4f(at - reach, at + reach);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Corner {
    let t = tree_of(sorted[instance]);
    let s = species_table[t.species];
    let center = place_of(t, s.view_center);
    let toward = -normalize(center);
    var out: Corner;
    let aside = length(toward.xz);
    let right = select(vec3f(1.0, 0.0, 0.0), vec3f(toward.z, 0.0, -toward.x) / aside, aside > 1e-6);
    let up = cross(toward, right);
    // In the tree's own frame.
    let back = vec2f(t.turn.x, -t.turn.y);
    let from_tree = turned(back, toward);
    let row = (asin(clamp(from_tree.y, -1.0, 1.0)) / HALF_TURN + 0.5) * f32(COMPASS_UP);
    let column = (atan2(from_tree.x, from_tree.z) / HALF_TURN * 0.5 + 0.5) * f32(COMPASS_AROUND);
    let cell = min(u32(row), COMPASS_UP - 1u) * COMPASS_AROUND + u32(column) % COMPASS_AROUND;
    let found = compass[s.first_compass + cell];
    let views = vec3u(found.x & 0xffffu, found.x >> 16u, found.y & 0xffffu);
    let first = f32((found.y >> 16u) & 0xffu) / 255.0;
    out.shares = vec2f(first, first + f32(found.y >> 24u) / 255.0);
    let board = board_of(t, s);
    let level = levels[s.first_level + board.level];
    // The quad holds what the three show.
    let frames = s.first_frame + views;
    let v = array(view_frames[frames.x], view_frames[frames.y], view_frames[frames.z]);
    let across = turned(back, right);
    let down = turned(back, -up);
    let a = shown(v[0], level.first_tile + views.x, level.texels, across, down);
    let b = shown(v[1], level.first_tile + views.y, level.texels, across, down);
    let c = shown(v[2], level.first_tile + views.z, level.texels, across, down);
    let low = min(min(a.xy, b.xy), c.xy);
    let high = max(max(a.zw, b.zw), c.zw);
    let half = 0.5 * s.view_side * t.scale;
    // Room for how far its top leans.
    let leaning = lean_of(t, s);
    let lean = turned(back, vec3f(leaning.x, 0.0, leaning.y));
    let square = pow(2.0 * s.tall * t.scale, 2.0);
    let room = abs(vec2f(dot(lean, across), dot(lean, down))) * (square / half);
    let corner = mix(low - room, high + room, vec2f(f32(index & 1u), f32(index >> 1u)));
    let tile_lean = array(
        on_tile(v[0], lean, half, level.texels),
        on_tile(v[1], lean, half, level.texels),
        on_tile(v[2], lean, half, level.texels),
    );
    out.lean = vec4f(tile_lean[0], tile_lean[1]);
    out.lean_last = vec3f(tile_lean[2], t.foot.y);
    out.place = center + (right * corner.x - up * corner.y) * half;
    let at = project(out.place);
    // It stands about the tree's axis.
    let tall = s.tall * t.scale;
    let height = clamp(-corner.y * half / max(up.y, 0.1), -tall, tall);
    let depth = dot(center, frame.forward) + height * frame.forward.y;
    out.position = flat_clip(at.xy, depth_value(depth));
    let local = turned(back, center);
    let ray = turned(back, out.place);
    out.at = level.texels * vec4f(tile_at(v[0], local, ray, half), tile_at(v[1], local, ray, half));
    out.at_last = level.texels * tile_at(v[2], local, ray, half);
    out.views = views + level.first_tile;
    out.rise = toward * select(0.0, half * level.reach, level.has_depth != 0u);
    out.mask = t.mask;
    out.share = board.share;
    let left = exp(-s.clump);
    out.sun = frame.sun * (scattered(dot(toward, frame.to_sun), frame.translucency) * left);
    // The mean of normals turned to the eye, by their projected area, is two thirds long.
    out.sky = frame.sky * (skyward(toward * (2.0 / 3.0)) * left);
    return out;
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4f {
    let sample = vec2u(in.position.xy);
    if !fades_in(vec2f(0.0, in.share), sample) {
        discard;
    }
    let pick = sample_hash(PICK ^ in.mask, sample);
    // What is seen there stood elsewhere at rest.
    let height = max(in.place.y - in.lean_last.z, 0.0);
    let square = height * height;
    var view = in.views.x;
    var at = in.at.xy - in.lean.xy * square;
    if pick >= in.shares.y {
        view = in.views.z;
        at = in.at_last - in.lean_last.xy * square;
    } else if pick >= in.shares.x {
        view = in.views.y;
        at = in.at.zw - in.lean.zw * square;
    }
    let p = page_texel(tile_of(view), vec2i(floor(at)));
    if p.x < 0 {
        discard;
    }
    let color = textureLoad(color_pages, p.xy, p.z, 0);
    if !covers(COVER ^ in.mask, sample, u32(color.a * 255.0 + 0.5)) {
        discard;
    }
    if frame.lit == 0u {
        return vec4f(color.rgb, 1.0);
    }
    let toward = 1.0 - 2.0 * textureLoad(depth_pages, p.xy, p.z, 0).x;
    let seen = seen_at(in.place + in.rise * toward);
    return vec4f(color.rgb * (in.sun * seen.x + in.sky * seen.y), 1.0);
}
