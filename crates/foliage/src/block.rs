//! Reading the foliage of a pack.

use crate::dictionary::{MIPS, decode};
use crate::header::{DICTIONARY, Draw, FoliageHeader, LevelHeader, VertexRecord};
use crate::validate::{is_material, validate, validate_header};
use crate::wind::{BranchRecord, FLUTTER, FLUTTER_FREQUENCY, Pose, Wind};
use forest_pack::measures::{ErrorKind, Light, Need};
use forest_pack::{Pack, PackError, SectionId, header, kind};
use forest_points::read_materials;
use forest_points::record::decode_axis;
use forest_soup::{AlphaMode, Camera, Material, Texture, TriangleSoup, Wrap, srgb8_to_linear};
use glam::{DVec3, Vec2, Vec3};
use std::borrow::Cow;
use std::sync::Arc;

/// The foliage representation of a pack; vertices and texels stay in the memory map.
#[derive(Clone, Debug)]
pub struct FoliageBlock<'a> {
    /// The header.
    pub header: FoliageHeader,
    /// Branches as wind moves them.
    pub branches: &'a [BranchRecord],
    /// Vertices of each level.
    pub vertices: Vec<&'a [VertexRecord]>,
    /// Triangles of each level, by draws.
    pub indices: Vec<&'a [[u32; 3]]>,
    pack: &'a Pack,
}

/// One resolution of a dictionary.
#[derive(Clone, Debug)]
pub struct Mip<'a> {
    /// Texels across and down.
    pub size: [u32; 2],
    /// Blocks or texels, row by row.
    pub bytes: Cow<'a, [u8]>,
}

/// Bytes of a 4 × 4 block of the dictionary.
const BLOCK_BYTES: u64 = 16;

impl<'a> FoliageBlock<'a> {
    /// Whether a pack has foliage.
    pub fn is_in(pack: &Pack) -> bool {
        pack.contains(SectionId::new(kind::FOLIAGE_HEADER, 0))
    }

    /// Opens and checks the foliage of a pack.
    ///
    /// # Errors
    /// When a section is missing or damaged, or breaks a rule of SPEC.md, section 8.
    pub fn open(pack: &'a Pack) -> Result<Self, PackError> {
        let id = SectionId::new(kind::FOLIAGE_HEADER, 0);
        let header: FoliageHeader = header::decode(pack, id)?;
        validate_header(&header).map_err(|p| PackError::invalid(pack.path(), id, p))?;
        let levels = 0..header.levels.len() as u32;
        let vertices = |l| pack.records(SectionId::new(kind::FOLIAGE_VERTICES, l));
        let indices = |l| pack.records(SectionId::new(kind::FOLIAGE_INDICES, l));
        let block = Self {
            branches: pack.records(SectionId::new(kind::WIND_BRANCHES, 0))?,
            vertices: levels.clone().map(vertices).collect::<Result<_, _>>()?,
            indices: levels.map(indices).collect::<Result<_, _>>()?,
            header,
            pack,
        };
        validate(&block.header, block.branches, &block.vertices, &block.indices).map_err(
            |(kind, index, problem)| {
                PackError::invalid(pack.path(), SectionId::new(kind, index), problem)
            },
        )?;
        Ok(block)
    }

    /// World position of the zero of vertices and branches.
    pub fn origin(&self) -> DVec3 {
        DVec3::from_array(self.header.origin)
    }

    /// Smallest and largest corner of the source's box, in the world.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.header.bounds.map(|p| self.origin() + DVec3::from_array(p))
    }

    /// The dictionary as it is stored ([`FoliageHeader::blocks`]), finest resolution first.
    ///
    /// # Errors
    /// When a section is missing or damaged, or has another length.
    pub fn stored(&self) -> Result<Vec<Mip<'a>>, PackError> {
        let mip = |m: u32| {
            let id = SectionId::new(kind::FOLIAGE_ATLAS, m);
            let size = self.header.atlas.map(|s| s >> m);
            let blocks = u64::from(size[0] / 4) * u64::from(size[1] / 4);
            let want = blocks * if self.header.blocks { BLOCK_BYTES } else { 64 };
            let bytes = self.pack.bytes(id, want)?;
            if bytes.len() as u64 != want {
                let problem = format!("{} bytes for {size:?} texels; {want}", bytes.len());
                return Err(PackError::invalid(self.pack.path(), id, problem));
            }
            Ok(Mip { size, bytes })
        };
        (0..MIPS).map(mip).collect()
    }

    /// The dictionary's texels at its finest resolution: sRGB, not premultiplied, and coverage.
    ///
    /// # Errors
    /// When the section is missing or damaged.
    pub fn dictionary(&self) -> Result<Texture, PackError> {
        let Mip { size, bytes } = self.stored()?.swap_remove(0);
        let texels = match self.header.blocks {
            true => decode(&bytes, size[0]),
            false => bytes.as_chunks::<4>().0.to_vec(),
        };
        Ok(dictionary_texture(size, texels))
    }

    /// Materials and textures that levels are drawn with: those of the source, and last the
    /// dictionary.
    ///
    /// # Errors
    /// When a section is missing or damaged, or a draw's material is not there.
    pub fn materials(&self) -> Result<(Vec<Material>, Vec<Arc<Texture>>), PackError> {
        let (mut materials, mut textures) = read_materials(self.pack)?;
        for (l, level) in (0..).zip(&self.header.levels) {
            let known = |d: &&Draw| !is_material(d.material, materials.len());
            if let Some(d) = level.draws.iter().find(known) {
                let id = SectionId::new(kind::FOLIAGE_HEADER, 0);
                let problem =
                    format!("level {l} uses material {} of {}", d.material, materials.len());
                return Err(PackError::invalid(self.pack.path(), id, problem));
            }
        }
        materials.push(dictionary_material(textures.len() as u32, self.header.translucency));
        textures.push(Arc::new(self.dictionary()?));
        Ok((materials, textures))
    }

    /// The level for `camera`: the coarsest whose texels are not wider than `pixels` where the tree
    /// is nearest.
    pub fn select(&self, camera: &Camera, pixels: f64) -> usize {
        let [min, max] = self.bounds();
        let nearest = camera.eye.clamp(min, max);
        let depth = (nearest - camera.eye).dot(camera.forward);
        let wide = match camera.projection {
            forest_soup::Projection::Orthographic { .. } => camera.pixels_per_unit(1.0),
            _ if depth <= 0.0 => f64::INFINITY,
            _ => camera.pixels_per_unit(depth),
        };
        let fits = |l: &LevelHeader| l.texel * wide <= pixels;
        self.header.levels.iter().rposition(fits).unwrap_or(0)
    }

    /// What a pack's measured table is to be asked for this foliage before `camera`.
    pub fn need(&self, camera: &Camera, error: ErrorKind) -> Need {
        let (height, elevation) = camera.sees(self.bounds());
        Need {
            representation: kind::FOLIAGE_HEADER,
            pixel_height: height as f32,
            elevation: Some(elevation as f32),
            light: Light::Albedo,
            error,
        }
    }

    /// Level `level` as a soup in the world, as `pose` bends it; `materials` and `textures` are those
    /// of [`FoliageBlock::materials`]. Leaves turn about the way to `eye`.
    pub fn soup(
        &self,
        level: usize,
        posed: Option<Posed>,
        materials: &[Material],
        textures: &[Arc<Texture>],
    ) -> TriangleSoup {
        let header = &self.header.levels[level];
        let (vertices, triangles) = (self.vertices[level], self.indices[level]);
        let mut soup = level_soup(header, vertices, triangles, materials, textures);
        soup.origin = self.origin();
        if let Some(posed) = &posed {
            let place = |v: &VertexRecord| posed.place(self, v);
            (soup.positions, soup.normals) = vertices.iter().map(place).unzip();
        }
        soup
    }
}

/// A level at rest as a soup, about the block's origin.
pub(crate) fn level_soup(
    header: &LevelHeader,
    vertices: &[VertexRecord],
    triangles: &[[u32; 3]],
    materials: &[Material],
    textures: &[Arc<Texture>],
) -> TriangleSoup {
    let dictionary = materials.len() as u16 - 1;
    let material = |d: &Draw| if d.material == DICTIONARY { dictionary } else { d.material };
    let color = |v: &VertexRecord| {
        let [r, g, b, a] = v.color;
        let [r, g, b] = [r, g, b].map(srgb8_to_linear);
        [r, g, b, f32::from(a) / 255.0]
    };
    let sunlit = |i: u32| if i < header.wood_vertices { 1.0 } else { header.sunlit };
    TriangleSoup {
        positions: vertices.iter().map(|v| v.position.into()).collect(),
        normals: vertices.iter().map(|v| decode_axis(v.normal).as_vec3()).collect(),
        uvs: vertices.iter().map(|v| Vec2::from(v.uv)).collect(),
        colors: vertices.iter().map(color).collect(),
        sunlit: (0..vertices.len() as u32).map(sunlit).collect(),
        skylit: vertices.iter().map(|v| f32::from(v.openness) / 255.0).collect(),
        triangles: triangles.to_vec(),
        triangle_materials: header
            .draws
            .iter()
            .flat_map(|d| std::iter::repeat_n(material(d), d.triangles as usize))
            .collect(),
        materials: materials.to_vec(),
        textures: textures.to_vec(),
        ..TriangleSoup::default()
    }
}

/// The material of what lies on cards and sheets; its texture is number `texture`, and it has this share of
/// a light's translucency.
pub(crate) fn dictionary_material(texture: u32, translucency: f32) -> Material {
    Material {
        name: "dictionary".into(),
        texture: Some(texture),
        // What covers a part of a texel covers a part of its samples.
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        translucency,
        // Its pictures hold many leaves.
        scattered: true,
        ..Material::default()
    }
}

/// The texture of a dictionary.
pub(crate) fn dictionary_texture([width, height]: [u32; 2], texels: Vec<[u8; 4]>) -> Texture {
    Texture { name: "dictionary".into(), width, height, texels, wrap: [Wrap::Clamp; 2] }
}

/// A tree in the wind, as an eye sees it.
#[derive(Clone, Debug)]
pub struct Posed {
    pose: Pose,
    wind: Wind,
    phase: f32,
    /// About the block's origin.
    eye: Vec3,
}

impl Posed {
    /// The tree of `block` in `wind`, seen from `eye` in the world; `phase` in turns tells trees of one
    /// kind apart.
    pub fn new(block: &FoliageBlock, wind: &Wind, phase: f32, eye: DVec3) -> Self {
        let pose = Pose::new(block.branches, wind, phase);
        Self { pose, wind: *wind, phase, eye: (eye - block.origin()).as_vec3() }
    }

    /// How its branches stand.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// By how much leaves turn at most, in radians, and where in their swing they are, in turns, before
    /// each leaf's own phase.
    pub fn flutter(&self) -> (f32, f32) {
        let swing = self.wind.time * FLUTTER_FREQUENCY + self.phase;
        (FLUTTER * self.wind.strength, swing.fract())
    }

    /// Place and normal of a vertex.
    pub(crate) fn place(&self, block: &FoliageBlock, v: &VertexRecord) -> (Vec3, Vec3) {
        let mut p = Vec3::from(v.position);
        if v.flutter > 0 {
            let step = block.header.pivot_step as f32;
            let pivot = p + Vec3::from(v.pivot.map(f32::from)) * step;
            let (most, swing) = self.flutter();
            let turns = (swing + f32::from(v.phase) / 65536.0).fract();
            let angle = most * (turns * std::f32::consts::TAU).sin() * f32::from(v.flutter) / 255.0;
            let axis = (self.eye - pivot).normalize_or(Vec3::Z);
            p = pivot + glam::Quat::from_axis_angle(axis, angle) * (p - pivot);
        }
        let normal = self.pose.direction(v.hung, decode_axis(v.normal).as_vec3());
        (self.pose.place(block.branches, v.hung, p), normal)
    }
}
