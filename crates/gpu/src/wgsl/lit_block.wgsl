// The light on a block that stands alone.

// What comes through its crown of sun and sky, in the middles of cells: forest_foliage::CrownShade.
@group(0) @binding(1) var shade_grid: texture_3d<f32>;

// Linear between the middles of the cells around a place from the eye, outside of the grid that of its
// nearest place.
fn comes_through(place: vec3f) -> vec2f {
    let last = vec3i(textureDimensions(shade_grid)) - 1;
    let cells = (place - frame.shade_low) * frame.shade_scale - 0.5;
    let at = clamp(cells, vec3f(0.0), vec3f(last));
    let low = floor(at);
    let share = at - low;
    var sum = vec2f(0.0);
    for (var k = 0; k < 8; k++) {
        let off = vec3i(k & 1, (k >> 1u) & 1, k >> 2u);
        let near = select(1.0 - share, share, off == vec3i(1));
        sum += near.x * near.y * near.z * textureLoad(shade_grid, min(vec3i(low) + off, last), 0).xy;
    }
    return sum;
}

// Share of the sky that a surface is turned to: a block alone has no ground.
fn skyward(normal: vec3f) -> f32 {
    return 1.0;
}

// Shares of the sun and of the sky that are seen at a place from the eye: what comes through the crown, and
// of the sun the estimate of Gilet et al. 2005, section 5.3, which falls from 1 at the side of the block
// nearest to it to `darkest` at the far one.
fn seen_at(place: vec3f) -> vec2f {
    if frame.lit == 0u {
        return vec2f(1.0);
    }
    let z = clamp(-dot(place - frame.middle, frame.to_sun) / frame.half_diagonal, -1.0, 1.0);
    let estimate = 1.0 - 0.5 * (z + 1.0) * (1.0 - frame.darkest);
    return frame.crown * comes_through(place) * vec2f(estimate, 1.0);
}
