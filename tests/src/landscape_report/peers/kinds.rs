//! A species on the device: its levels of meshes, or its billboards.

use crate::peers::boards::{self, BoardUniform};
use crate::peers::device::{self, Draws, Kind};
use crate::peers::lods::{Mesh, MeshLevel, Vertex};
use crate::peers::texture::{self, Coverage, Level};
use bytemuck::{Pod, Zeroable};
use forest_gpu::Gpu;
use forest_scene::Stance;
use forest_soup::{AlphaMode, Material, TriangleSoup, Wrap};
use wgpu::{
    AddressMode, BindGroup, BindGroupLayout, BindingResource, Buffer, BufferUsages,
    CompareFunction, FilterMode, IndexFormat, MipmapFilterMode, PrimitiveTopology, RenderPass,
    RenderPipeline, Sampler, SamplerDescriptor, Texture, TextureViewDescriptor,
    TextureViewDimension, VertexBufferLayout, VertexStepMode, vertex_attr_array,
};

/// How trees are drawn.
#[derive(Debug)]
pub(crate) struct TreePipelines {
    mesh_layout: BindGroupLayout,
    board_layout: BindGroupLayout,
    opaque: RenderPipeline,
    tested: RenderPipeline,
    boards: RenderPipeline,
}

impl TreePipelines {
    pub(crate) fn new(gpu: &Gpu, common: &str, view: &BindGroupLayout) -> Self {
        let mesh_layout = device::layout(gpu, &[Kind::Uniform, Kind::Texture, Kind::Sampler]);
        let kinds = [Kind::Uniform, Kind::Array, Kind::Array, Kind::Sampler];
        let board_layout = device::layout(gpu, &kinds);
        let mesh = device::module(gpu, &[common, include_str!("mesh.wgsl")]);
        let board = device::module(gpu, &[common, include_str!("billboard.wgsl")]);
        let attributes =
            vertex_attr_array![0 => Float32x3, 1 => Snorm8x4, 2 => Float32x2, 3 => Unorm8x4];
        let vertices = [Some(VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: VertexStepMode::Vertex,
            attributes: &attributes,
        })];
        let opaque = Draws {
            module: &mesh,
            fragment: "fragment",
            groups: &[view, &mesh_layout],
            vertices: &vertices,
            topology: PrimitiveTopology::TriangleList,
            format: device::COLOR,
            depth: Some(CompareFunction::Greater),
        };
        let tested = Draws { fragment: "tested", ..opaque };
        let boards = Draws {
            module: &board,
            groups: &[view, &board_layout],
            vertices: &[],
            topology: PrimitiveTopology::TriangleStrip,
            ..opaque
        };
        Self {
            opaque: device::pipeline(gpu, &opaque),
            tested: device::pipeline(gpu, &tested),
            boards: device::pipeline(gpu, &boards),
            mesh_layout,
            board_layout,
        }
    }
}

/// A species.
#[derive(Debug)]
pub(crate) enum Stock {
    Meshes {
        vertices: Buffer,
        indices: Buffer,
        levels: Vec<MeshLevel>,
        /// Of each material: its group, and whether alpha is tested.
        materials: Vec<(BindGroup, bool)>,
        bytes: u64,
    },
    Boards {
        group: BindGroup,
        bytes: u64,
    },
}

/// `Material` of mesh.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct MaterialUniform {
    base: [f32; 4],
    cutoff: f32,
    unlit: u32,
    zero: [u32; 2],
}

impl Stock {
    pub(crate) fn meshes(
        gpu: &Gpu,
        pipelines: &TreePipelines,
        soup: &TriangleSoup,
        mesh: Mesh,
    ) -> Self {
        let vertices =
            device::filled(gpu, bytemuck::cast_slice(&mesh.vertices), BufferUsages::VERTEX);
        let indices = device::filled(gpu, bytemuck::cast_slice(&mesh.indices), BufferUsages::INDEX);
        let mut bytes = vertices.size() + indices.size();
        let group = |m: &Material| {
            let (group, size, tested) = material(gpu, &pipelines.mesh_layout, soup, m);
            bytes += size;
            (group, tested)
        };
        let materials = soup.materials.iter().map(group).collect();
        Self::Meshes { vertices, indices, levels: mesh.levels, materials, bytes }
    }

    pub(crate) fn boards(
        gpu: &Gpu,
        pipelines: &TreePipelines,
        soup: &TriangleSoup,
        stance: &Stance,
    ) -> Self {
        let baked = boards::bake(soup, stance);
        let (colors, color_bytes) = texture::upload(gpu, &baked.colors, true);
        let (normals, normal_bytes) = texture::upload(gpu, &baked.normals, false);
        let uniform = uniform::<BoardUniform>(gpu, &baked.uniform);
        let view = |t: &Texture| {
            let dimension = Some(TextureViewDimension::D2Array);
            t.create_view(&TextureViewDescriptor { dimension, ..Default::default() })
        };
        let (colors, normals) = (view(&colors), view(&normals));
        let resources = [
            uniform.as_entire_binding(),
            BindingResource::TextureView(&colors),
            BindingResource::TextureView(&normals),
            BindingResource::Sampler(&sampler(gpu, [Wrap::Clamp; 2])),
        ];
        let group = device::group(gpu, &pipelines.board_layout, &resources);
        Self::Boards { group, bytes: color_bytes + normal_bytes }
    }

    /// Triangles of each level, and the mean area of one.
    pub(crate) fn levels(&self) -> Vec<(u64, f64)> {
        match self {
            Self::Meshes { levels, .. } => levels.iter().map(|l| (l.triangles, l.area)).collect(),
            Self::Boards { .. } => vec![(2, 0.0)],
        }
    }

    pub(crate) fn triangles(&self, level: usize) -> u64 {
        match self {
            Self::Meshes { levels, .. } => levels[level].triangles,
            Self::Boards { .. } => 2,
        }
    }

    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::Meshes { bytes, .. } | Self::Boards { bytes, .. } => *bytes,
        }
    }

    /// Draws these trees of the list in a level; the number of draw calls.
    pub(crate) fn draw(
        &self,
        pass: &mut RenderPass,
        pipelines: &TreePipelines,
        level: usize,
        trees: std::ops::Range<u32>,
    ) -> u64 {
        match self {
            Self::Meshes { vertices, indices, levels, materials, .. } => {
                pass.set_vertex_buffer(0, vertices.slice(..));
                pass.set_index_buffer(indices.slice(..), IndexFormat::Uint32);
                let parts = &levels[level].parts;
                // What hides more comes first.
                for wanted in [false, true] {
                    for (m, range) in parts.iter().filter(|p| materials[p.0].1 == wanted) {
                        let used = if wanted { &pipelines.tested } else { &pipelines.opaque };
                        pass.set_pipeline(used);
                        pass.set_bind_group(1, &materials[*m].0, &[]);
                        pass.draw_indexed(range.clone(), 0, trees.clone());
                    }
                }
                parts.len() as u64
            }
            Self::Boards { group, .. } => {
                pass.set_pipeline(&pipelines.boards);
                pass.set_bind_group(1, group, &[]);
                pass.draw(0..4, trees);
                1
            }
        }
    }
}

fn uniform<T: Pod>(gpu: &Gpu, value: &T) -> Buffer {
    device::filled(gpu, bytemuck::bytes_of(value), BufferUsages::UNIFORM)
}

/// A material's group, its texture's bytes, and whether alpha is tested: alpha that blends is, at a half.
fn material(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    soup: &TriangleSoup,
    m: &Material,
) -> (BindGroup, u64, bool) {
    let cutoff = match m.alpha_mode {
        AlphaMode::Opaque => None,
        AlphaMode::Mask { cutoff } => Some(cutoff),
        AlphaMode::Blend => Some(0.5),
    };
    let source = m.texture.map(|t| &soup.textures[t as usize]);
    let first = source
        .map_or_else(|| Level { size: [1, 1], texels: vec![[1.0; 4]] }, |s| texture::linear(s));
    let coverage = cutoff.map_or(Coverage::Opaque, |c| {
        Coverage::Tested((c / m.base_color[3].max(1e-3)).clamp(1e-3, 1.0))
    });
    let (image, bytes) = texture::upload(gpu, &[texture::mips(first, coverage)], true);
    let wrap = source.map_or([Wrap::Repeat; 2], |s| s.wrap);
    let record = MaterialUniform {
        base: m.base_color,
        cutoff: cutoff.unwrap_or(0.0),
        unlit: m.unlit.into(),
        zero: [0; 2],
    };
    let uniform = uniform(gpu, &record);
    let resources = [
        uniform.as_entire_binding(),
        BindingResource::TextureView(&image.create_view(&Default::default())),
        BindingResource::Sampler(&sampler(gpu, wrap)),
    ];
    (device::group(gpu, layout, &resources), bytes, cutoff.is_some())
}

/// Trilinear.
fn sampler(gpu: &Gpu, wrap: [Wrap; 2]) -> Sampler {
    let mode = |w| match w {
        Wrap::Repeat => AddressMode::Repeat,
        Wrap::Mirror => AddressMode::MirrorRepeat,
        Wrap::Clamp => AddressMode::ClampToEdge,
    };
    gpu.device.create_sampler(&SamplerDescriptor {
        label: Some("trilinear"),
        address_mode_u: mode(wrap[0]),
        address_mode_v: mode(wrap[1]),
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        mipmap_filter: MipmapFilterMode::Linear,
        ..Default::default()
    })
}
