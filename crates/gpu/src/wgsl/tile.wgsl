// The tiles of views. The arrays are each shader's own.

struct ViewFrame {
    right: vec4f,
    up: vec4f,
    back: vec4f,
}

// The stored part of a tile.
struct Tile {
    // In the whole tile.
    corner: vec2i,
    size: vec2i,
    // Where it lies.
    page: vec3i,
}

fn tile_of(view: u32) -> Tile {
    let t = tiles[view];
    let corner = vec2i(i32(t.z << 16u) >> 16u, i32(t.z) >> 16u);
    let size = vec2i(i32(t.w & 0xffffu), i32(t.w >> 16u));
    return Tile(corner, size, vec3i(i32(t.x & 0xffffu), i32(t.x >> 16u), i32(t.y & 0xffffu)));
}

// Texel of the pages that texel `at` of a whole tile is: x, y, page; negative where nothing is stored.
fn page_texel(t: Tile, at: vec2i) -> vec3i {
    let p = at - t.corner;
    if any(p < vec2i(0)) || any(p >= t.size) {
        return vec3i(-1);
    }
    return t.page + vec3i(p, 0);
}
