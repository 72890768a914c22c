// How branches bend: forest_foliage::wind.

struct Branch {
    base: vec3f,
    parent: u32,
    // The middle line is base + linear·s + square·s².
    linear: vec3f,
    at: f32,
    square: vec3f,
    length: f32,
    flexibility: f32,
    phase: f32,
    frequency: f32,
    level: u32,
}

struct BranchPose {
    // A quaternion: the frame at its base.
    turn: vec4f,
    base: vec3f,
    // By how much its direction turns from base to tip, and about which axis.
    angle: f32,
    axis: vec3f,
    spare: f32,
}

// The branch of forest_foliage::Hung, and how far along it.
fn branch_of(hung: u32) -> u32 {
    return hung & 0xffffu;
}

fn share_of(hung: u32) -> f32 {
    return f32(hung >> 16u) / ALONG_STEPS;
}

fn rotated(q: vec4f, v: vec3f) -> vec3f {
    let t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

// Turns about a unit axis.
fn turned_about(v: vec3f, axis: vec3f, angle: f32) -> vec3f {
    let c = cos(angle);
    return v * c + cross(axis, v) * sin(angle) + axis * (dot(axis, v) * (1.0 - c));
}

// Integrals from 0 to s of cos(θu), sin(θu), 2u·cos(θu) and 2u·sin(θu).
fn bend_integrals(angle: f32, s: f32) -> vec4f {
    let x = angle * s;
    if abs(x) < 0.25 {
        let x2 = x * x;
        return vec4f(
            s * (1.0 - x2 / 6.0 * (1.0 - x2 / 20.0)),
            s * x * 0.5 * (1.0 - x2 / 12.0 * (1.0 - x2 / 30.0)),
            s * s * (1.0 - x2 / 4.0 * (1.0 - x2 / 18.0)),
            s * s * x * (2.0 / 3.0) * (1.0 - x2 / 10.0 * (1.0 - x2 / 28.0)),
        );
    }
    let per = 1.0 / angle;
    let c = 1.0 - cos(x);
    return per * vec4f(sin(x), c, 2.0 * (s * sin(x) - c * per), 2.0 * (sin(x) * per - s * cos(x)));
}

// Where something is that rests at `p`, `s` along a branch.
fn bent_place(branch: Branch, pose: BranchPose, p: vec3f, s: f32) -> vec3f {
    let k = bend_integrals(pose.angle, s);
    let along_a = pose.axis * dot(pose.axis, branch.linear);
    let along_b = pose.axis * dot(pose.axis, branch.square);
    let line = along_a * s + along_b * (s * s)
        + (branch.linear - along_a) * k.x + cross(pose.axis, branch.linear) * k.y
        + (branch.square - along_b) * k.z + cross(pose.axis, branch.square) * k.w;
    let off = p - branch.base - (branch.linear + branch.square * s) * s;
    return pose.base + rotated(pose.turn, line + turned_about(off, pose.axis, pose.angle * s));
}

fn bent_direction(pose: BranchPose, v: vec3f, s: f32) -> vec3f {
    return rotated(pose.turn, turned_about(v, pose.axis, pose.angle * s));
}
