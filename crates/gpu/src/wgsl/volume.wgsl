// Volumes: billboards of cells from back to front, blended. Of each cell the billboards of two cameras
// make one: forest_draw::volume. A code is decompressed where it is drawn: by a look-up.

struct Shown {
    // Axes of the billboards as they are drawn: parallel to the picture.
    right: vec3f,
    share: f32,
    up: vec3f,
    camera: u32,
    // Half the size of the billboard of a cell of side 1.
    half: vec2f,
    zero: vec2f,
}

struct Level {
    // First word of its colour and of its alpha codes; of raw texels the first row, in x.
    codes: vec2u,
    // Number of its first node.
    nodes: u32,
    // Side of a cell, in world units.
    side: f32,
}

struct Volume {
    // Of the root cell, from the eye.
    corner: vec3f,
    // Texels along the side of a billboard.
    texels: u32,
    fade: vec2f,
    shown: u32,
    // Words of a node's mask of cameras.
    mask_words: u32,
    // Bits of a colour and an alpha code; 0 bits of colour for raw texels.
    bits: vec2u,
    // 1 to draw one camera over the other, else their mean.
    over: u32,
    coded: u32,
    cameras: array<Shown, 2>,
    levels: array<Level, MOST_LEVELS>,
}

struct Item {
    level: u32,
    node: u32,
    weight: f32,
    zero: u32,
}

@group(1) @binding(0) var<uniform> volume: Volume;
@group(1) @binding(1) var<storage, read> items: array<Item>;
// Five words each.
@group(1) @binding(2) var<storage, read> nodes: array<u32>;
@group(1) @binding(3) var<storage, read> masks: array<u32>;
@group(1) @binding(4) var<storage, read> codes: array<u32>;
// The codewords, or the raw texels.
@group(1) @binding(5) var words: texture_2d_array<f32>;

// How far out of a billboard, in texels, a sample still is on its edge: no cracks by rounding.
const EDGE = 1e-3;

const NO_FACE = 0xffffffffu;

struct Billboard {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) center: vec2f,
    @location(1) @interpolate(flat) weight: f32,
    // Of both cameras colour and alpha code, or number of the first texel and row of the level.
    @location(2) @interpolate(flat) faces: vec4u,
    // Pixels that a cell takes.
    @location(3) @interpolate(flat) cell: f32,
    // Factors on its colour.
    @location(4) @interpolate(flat) light: vec3f,
}

// The number of a node's billboard for a camera, or none.
fn billboard(node: u32, camera: u32) -> u32 {
    let first = node * volume.mask_words;
    let word = camera / 32u;
    let bit = camera % 32u;
    let here = masks[first + word];
    if ((here >> bit) & 1u) == 0u {
        return NO_FACE;
    }
    var before = countOneBits(here & ((1u << bit) - 1u));
    for (var i = 0u; i < word; i++) {
        before += countOneBits(masks[first + i]);
    }
    return nodes[node * 5u + 4u] + before;
}

// Number `i` of `bits` bits each from word `first` on: forest_vq::read_bits.
fn code(first: u32, bits: u32, i: u32) -> u32 {
    if bits == 0u {
        return 0u;
    }
    // In 32 bits up to 2³² / 16 billboards: more than a section holds.
    let at = i * bits;
    let word = first + at / 32u;
    let shift = at % 32u;
    var v = codes[word] >> shift;
    if shift + bits > 32u {
        v |= codes[word + 1u] << (32u - shift);
    }
    return v & ((1u << bits) - 1u);
}

fn face(level: Level, node: u32, camera: u32) -> vec2u {
    let n = billboard(node, camera);
    if n == NO_FACE {
        return vec2u(NO_FACE);
    }
    if volume.coded == 0u {
        return vec2u(n * volume.texels * volume.texels, level.codes.x);
    }
    return vec2u(code(level.codes.x, volume.bits.x, n), code(level.codes.y, volume.bits.y, n));
}

// Half the box around the picture of a camera's billboard, in cells' sides.
fn box_of(shown: Shown) -> vec2f {
    let r = abs(vec2f(dot(shown.right, frame.right), dot(shown.right, frame.down)));
    let u = abs(vec2f(dot(shown.up, frame.right), dot(shown.up, frame.down)));
    return r * shown.half.x + u * shown.half.y;
}

@vertex
fn vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Billboard {
    let item = items[instance];
    let level = volume.levels[item.level];
    let node = level.nodes + item.node;
    let xy = nodes[node * 5u];
    let place = vec3f(vec3u(xy & 0xffffu, xy >> 16u, nodes[node * 5u + 1u] & 0xffffu));
    let still = volume.corner + (place + 0.5) * level.side;
    let center = still + sway_at(still.y, frame.foot, frame.lean);
    let at = project(center);
    var out: Billboard;
    out.center = at.xy;
    out.weight = item.weight;
    out.cell = level.side * select(frame.scale / at.z, frame.scale, frame.parallel != 0u);
    out.faces = vec4u(NO_FACE);
    var reach = vec2f(0.0);
    for (var k = 0u; k < volume.shown; k++) {
        let shown = volume.cameras[k];
        let f = face(level, node, shown.camera);
        if k == 0u {
            out.faces = vec4u(f, NO_FACE, NO_FACE);
        } else {
            out.faces = vec4u(out.faces.xy, f);
        }
        if f.x != NO_FACE {
            // A little more: neighbours round the edge that they share each in their own way.
            reach = max(reach, box_of(shown) * out.cell + 0.01);
        }
    }
    out.light = vec3f(1.0);
    if frame.relit != 0u && frame.lit != 0u {
        // The estimate is that of the tree at rest.
        let seen = seen_at(still) * on_crown(GAIN_VOLUME);
        let direct = scattered(dot(to_eye(still), frame.to_sun), frame.translucency) * seen.x;
        out.light = frame.sun * direct + frame.sky * seen.y;
    }
    let corner = vec2f(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
    out.position = flat_clip(at.xy + corner * reach, depth_value(at.z));
    return out;
}

// Premultiplied linear RGBA of a camera's billboard `off` pixels from its middle.
fn face_color(shown: Shown, codes_or_texel: vec2u, off: vec2f, cell: f32) -> vec4f {
    let side = f32(volume.texels);
    let right = vec2f(dot(shown.right, frame.right), dot(shown.right, frame.down));
    let down = -vec2f(dot(shown.up, frame.right), dot(shown.up, frame.down));
    let at = 0.5 * side + vec2f(dot(off, right), dot(off, down)) * (0.5 * side) / (shown.half * cell);
    if !(all(at >= vec2f(-EDGE)) && all(at <= vec2f(side + EDGE))) {
        return vec4f(0.0);
    }
    let t = min(vec2u(max(at, vec2f(0.0))), vec2u(volume.texels - 1u));
    var c: vec4f;
    if volume.coded != 0u {
        c = vec4f(word(codes_or_texel.x, t).rgb, word(codes_or_texel.y, t).a);
    } else {
        let i = codes_or_texel.x + t.y * volume.texels + t.x;
        let row = codes_or_texel.y + i / RAW_SIDE;
        c = textureLoad(words, vec2u(i % RAW_SIDE, row % RAW_SIDE), row / RAW_SIDE, 0);
    }
    return vec4f(c.rgb * c.a, c.a);
}

// Texel `t` of codeword `n`: forest_volume::Codewords.
fn word(n: u32, t: vec2u) -> vec4f {
    let across = ATLAS_WIDTH / volume.texels;
    return textureLoad(words, vec2u(n % across, n / across) * volume.texels + t, 0u, 0);
}

@fragment
fn fragment(in: Billboard) -> @location(0) vec4f {
    if !fades_in(volume.fade, vec2u(in.position.xy)) {
        discard;
    }
    let off = in.position.xy - in.center;
    var color = vec4f(0.0);
    var shares = 0.0;
    for (var k = 0u; k < volume.shown; k++) {
        let f = select(in.faces.zw, in.faces.xy, k == 0u);
        if f.x == NO_FACE {
            continue;
        }
        let shown = volume.cameras[k];
        let c = face_color(shown, f, off, in.cell);
        if volume.over != 0u {
            color += (1.0 - color.a) * shown.share * c;
        } else {
            color += shown.share * c;
            shares += shown.share;
        }
    }
    if volume.over == 0u && shares > 0.0 {
        color /= shares;
    }
    if color.a <= 0.0 {
        discard;
    }
    if in.weight < 1.0 {
        let alpha = 1.0 - pow(max(1.0 - color.a, LEAST_THROUGH), in.weight);
        color *= alpha / color.a;
    }
    return color * vec4f(in.light, 1.0);
}
