// Materials with their textures at full resolution, and the alpha rule.

struct Material {
    base: vec4f,
    uv_min: vec2f,
    uv_step: vec2f,
    // 0 opaque, 1 mask, 2 blend.
    rule: u32,
    cutoff: f32,
    // Bit 0: unlit. Bit 1: its triangles have vertex colours. From bit 8: see `translucency_of`.
    flags: u32,
    // Number of the texture; all ones for none.
    image: u32,
    // The same of the normal texture, and what multiplies its x and y.
    relief: u32,
    relief_scale: f32,
}

// Share of the light's translucency.
fn translucency_of(m: Material) -> f32 {
    return f32(m.flags >> 8u) / TRANSLUCENCY_STEPS;
}

struct Image {
    // Where it lies.
    corner: vec2u,
    layer: u32,
    zero: u32,
    size: vec2u,
    // Along u and v: 0 repeat, 1 mirror, 2 clamp.
    wrap: vec2u,
}

@group(1) @binding(2) var<storage, read> materials: array<Material>;
@group(1) @binding(3) var<storage, read> images: array<Image>;
@group(1) @binding(5) var sheet: texture_2d_array<f32>;

fn wrapped(rule: u32, i: i32, n: i32) -> i32 {
    if rule == 2u {
        return clamp(i, 0, n - 1);
    }
    let turn = select(n, 2 * n, rule == 1u);
    let m = ((i % turn) + turn) % turn;
    return select(m, turn - 1 - m, m >= n);
}

// Premultiplied linear RGBA of a texel.
fn texel(image: Image, at: vec2i, opaque: bool) -> vec4f {
    let size = vec2i(image.size);
    let x = wrapped(image.wrap.x, at.x, size.x);
    let y = wrapped(image.wrap.y, at.y, size.y);
    let c = textureLoad(sheet, vec2i(image.corner) + vec2i(x, y), image.layer, 0);
    let a = select(c.a, 1.0, opaque);
    return vec4f(c.rgb * a, a);
}

fn sampled(image: Image, uv: vec2f, opaque: bool) -> vec4f {
    let at = uv * vec2f(image.size) - 0.5;
    let low = floor(at);
    let f = at - low;
    // Texture coordinates of hostile files do not fit an integer.
    let i = vec2i(clamp(low, vec2f(-1e9), vec2f(1e9)));
    let top = mix(texel(image, i, opaque), texel(image, i + vec2i(1, 0), opaque), f.x);
    let bottom = mix(texel(image, i + vec2i(0, 1), opaque), texel(image, i + 1, opaque), f.x);
    return mix(top, bottom, f.y);
}

// A normal of a texture in its own frame: forest_soup::NormalMap. The sheet decodes what it takes for sRGB.
fn bump_at(m: Material, uv: vec2f) -> vec3f {
    let image = images[m.relief];
    let at = uv * vec2f(image.size) - 0.5;
    let low = floor(at);
    let f = at - low;
    let i = vec2i(clamp(low, vec2f(-1e9), vec2f(1e9)));
    let top = mix(number(image, i), number(image, i + vec2i(1, 0)), f.x);
    let bottom = mix(number(image, i + vec2i(0, 1)), number(image, i + 1), f.x);
    let bump = (2.0 * mix(top, bottom, f.y) - 1.0) * vec3f(vec2f(m.relief_scale), 1.0);
    let length = length(bump);
    return select(vec3f(0.0, 0.0, 1.0), bump / length, length > 0.0);
}

// A texel of numbers.
fn number(image: Image, at: vec2i) -> vec3f {
    return linear_to_srgb(texel(image, at, true).rgb);
}

// How a place and its texture coordinates change from pixel to pixel.
struct Steps {
    right: vec3f,
    down: vec3f,
    uv_right: vec2f,
    uv_down: vec2f,
}

// The unit normal of a triangle that faces the eye, with the bumps of its material: forest_soup::Tangents.
fn bumpy(m: Material, normal: vec3f, front: bool, uv: vec2f, steps: Steps) -> vec3f {
    if m.relief == 0xffffffffu {
        return normal;
    }
    let area = steps.uv_right.x * steps.uv_down.y - steps.uv_right.y * steps.uv_down.x;
    let along_u = (steps.right * steps.uv_down.y - steps.down * steps.uv_right.y) * sign(area);
    let along_v = (steps.down * steps.uv_right.x - steps.right * steps.uv_down.x) * sign(area);
    let off = along_u - normal * dot(normal, along_u);
    if !(dot(off, off) > 0.0) {
        return normal;
    }
    let u = normalize(off);
    let across = cross(normal, u);
    let up = select(across, -across, dot(across, along_v) > 0.0);
    let bump = bump_at(m, uv);
    return normalize((u * bump.x + up * bump.y) * select(-1.0, 1.0, front) + normal * bump.z);
}

// Linear RGB of a material, and its coverage: forest_soup::Material::coverage.
fn surface_at(m: Material, uv: vec2f, tint: vec4f) -> vec4f {
    var rgb = m.base.rgb;
    var alpha = m.base.a * tint.a;
    if m.image != 0xffffffffu {
        let c = sampled(images[m.image], uv, m.rule == 0u);
        rgb *= select(vec3f(0.0), c.rgb / c.a, c.a > 0.0);
        alpha *= c.a;
    }
    var coverage = 1.0;
    if m.rule == 1u {
        coverage = select(0.0, 1.0, alpha >= m.cutoff);
    } else if m.rule == 2u {
        coverage = clamp(alpha, 0.0, 1.0);
    }
    return vec4f(rgb * tint.rgb, coverage);
}
