// Points and triangles of a block bend with its branches, where they are known.

@group(3) @binding(0) var<storage, read> branches: array<Branch>;
@group(3) @binding(1) var<storage, read> poses: array<BranchPose>;
// What moves each point, or each corner: forest_foliage::Hung.
@group(3) @binding(2) var<storage, read> hung: array<u32>;

// Where point or corner number `index` is that rests at `place` from the eye.
fn bent(index: u32, place: vec3f) -> vec3f {
    if frame.bends == 0u {
        return place;
    }
    let on = hung[index] & 0xffffu;
    let s = f32(hung[index] >> 16u) / 65535.0;
    return frame.root + bent_place(branches[on], poses[on], place - frame.root, s);
}

// Which way it faces that rests facing `axis`.
fn bent_axis(index: u32, axis: vec3f) -> vec3f {
    if frame.bends == 0u {
        return axis;
    }
    let on = hung[index] & 0xffffu;
    return bent_direction(poses[on], axis, f32(hung[index] >> 16u) / 65535.0);
}
