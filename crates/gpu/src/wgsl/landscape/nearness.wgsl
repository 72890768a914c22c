// What is covered. Of blocks of samples, the farthest depth value that was kept; the second and later
// levels have half as many blocks along each side. And probes: the depth values of a few samples.

struct Nearness {
    // Blocks across and down, first block, of each level; of the last one probes instead of blocks.
    levels: array<vec4u, MOST_NEARNESS>,
    values: array<f32>,
}

// Whether all samples from `low` to `high` are nearer than `value`. Looks at four by four blocks at most.
fn is_covered(low: vec2u, high: vec2u, value: f32) -> bool {
    var a = low / BLOCK;
    var b = high / BLOCK;
    var level = 0u;
    while any(b - a > vec2u(3u)) && level + 2u < MOST_NEARNESS {
        a /= 2u;
        b /= 2u;
        level++;
    }
    let l = nearness.levels[level];
    for (var y = a.y; y <= b.y; y++) {
        for (var x = a.x; x <= b.x; x++) {
            if nearness.values[l.z + y * l.x + x] <= value {
                return false;
            }
        }
    }
    return true;
}

// Most probes along a side of a box that are asked.
const MOST_PROBES = 6u;

// Estimated share of the samples from `low` to `high` that are not nearer than `value`: above 0.
fn open_share(low: vec2u, high: vec2u, value: f32) -> f32 {
    let l = nearness.levels[MOST_NEARNESS - 1u];
    let a = min(low / PROBE, l.xy - 1u);
    let b = min(high / PROBE, l.xy - 1u);
    let stride = (b - a) / MOST_PROBES + 1u;
    var seen = 0u;
    var all = 0u;
    for (var y = a.y; y <= b.y; y += stride.y) {
        for (var x = a.x; x <= b.x; x += stride.x) {
            seen += select(0u, 1u, nearness.values[l.z + y * l.x + x] <= value);
            all++;
        }
    }
    // As if there were half a probe more that is open: what few probes miss may be seen.
    return (f32(seen) + 0.5) / (f32(all) + 0.5);
}
