// Trees of a landscape lean as a whole: bend.wgsl without branches.

fn bent(index: u32, place: vec3f) -> vec3f {
    return place;
}

fn bent_axis(index: u32, axis: vec3f) -> vec3f {
    return axis;
}
