// The light on a block that stands alone.

// Share of the sun that is estimated to be seen (Gilet et al. 2005, section 5.3): falls from 1 at the
// side of the block nearest to the sun to `darkest` at the far one, of what a crown shows at all.
fn sun_seen(place: vec3f) -> f32 {
    let z = clamp(-dot(place - frame.middle, frame.to_sun) / frame.half_diagonal, -1.0, 1.0);
    return frame.crown.x * (1.0 - 0.5 * (z + 1.0) * (1.0 - frame.darkest));
}

// Share of the sky that a surface is turned to: a block alone has no ground.
fn skyward(normal: vec3f) -> f32 {
    return 1.0;
}

// Shares of the sun and of the sky that are seen at a place from the eye.
fn seen_at(place: vec3f) -> vec2f {
    return vec2f(sun_seen(place), frame.crown.y);
}
