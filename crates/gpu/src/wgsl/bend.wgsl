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
    let on = branch_of(hung[index]);
    return frame.root + bent_place(branches[on], poses[on], place - frame.root, share_of(hung[index]));
}

// Which way it faces that rests facing `axis`.
fn bent_axis(index: u32, axis: vec3f) -> vec3f {
    if frame.bends == 0u {
        return axis;
    }
    return bent_direction(poses[branch_of(hung[index])], axis, share_of(hung[index]));
}
