// Small points: one atomic operation a sample. Of every sample the nearest point is kept: the upper
// word is its depth value, the lower one what is known of it (of equal depths the largest wins).

// Pixels of the largest box that is filled here.
override SPLAT_MOST: u32 = 256u;

// First and last pixel whose middle may lie inside; the last before the first for none. What
// reaches out of the picture is cut before it becomes an integer.
fn box_of(e: Ellipse) -> vec4i {
    let low = clamp(ceil(e.center - e.reach - 0.5), vec2f(0.0), frame.size);
    let high = clamp(floor(e.center + e.reach - 0.5), vec2f(-1.0), frame.size - 1.0);
    return vec4i(vec2i(low), vec2i(high));
}

// Fills the samples of `box` that point number `id` covers.
fn splat_box(e: Ellipse, id: u32, fade: vec2f, box: vec4i, payload: u32) {
    let value = bitcast<u32>(depth_value(e.depth));
    for (var y = box.y; y <= box.w; y++) {
        for (var x = box.x; x <= box.z; x++) {
            let at = vec2u(vec2i(x, y));
            if contains(e, vec2f(at) + 0.5) && covers(id, at, e.opacity) && fades_in(fade, at) {
                keep(at.y * u32(frame.size.x) + at.x, value, payload);
            }
        }
    }
}
