// Instanced meshes: a material a draw.

struct Material {
    base: vec4f,
    cutoff: f32,
    unlit: u32,
    zero: vec2u,
}

@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var image: texture_2d<f32>;
@group(1) @binding(2) var image_sampler: sampler;

struct Corner {
    @location(0) place: vec3f,
    @location(1) normal: vec4f,
    @location(2) uv: vec2f,
    @location(3) color: vec4f,
}

struct Out {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) normal: vec3f,
    @location(2) tint: vec4f,
    @location(3) seen: vec2f,
}

@vertex
fn vertex(in: Corner, @builtin(instance_index) instance: u32) -> Out {
    let tree = trees[list[instance]];
    let off = from_eye(tree.foot) + turned(tree.turn, in.place) * tree.scale;
    var out: Out;
    out.position = clip(off);
    out.uv = in.uv;
    out.normal = turned(tree.turn, in.normal.xyz);
    out.tint = vec4f(srgb_to_linear(in.color.rgb), in.color.a);
    out.seen = seen_at(off) * tree.dark;
    return out;
}

fn shaded(in: Out, texel: vec4f, front: bool) -> vec4f {
    let rgb = material.base.rgb * in.tint.rgb * texel.rgb;
    let toward = normalize(select(-in.normal, in.normal, front));
    return vec4f(rgb * select(light(toward, in.seen), vec3f(1.0), material.unlit != 0u), 1.0);
}

@fragment
fn fragment(in: Out, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    return shaded(in, textureSample(image, image_sampler, in.uv), front);
}

@fragment
fn tested(in: Out, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let texel = textureSample(image, image_sampler, in.uv);
    if material.base.a * in.tint.a * texel.a < material.cutoff {
        discard;
    }
    return shaded(in, texel, front);
}
