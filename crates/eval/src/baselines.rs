//! The other ways: what the pack's source gives without this project's ideas, or with one of them.

use crate::contender::{Contender, Look, Way};
use crate::error::EvalError;
use forest_draw::{FoliageScene, ViewsLevel, VolumeScene};
use forest_pack::{Pack, PackWriter};
use forest_points::{BakeOptions, GridChoice, Order, PointsBlock, RadiusRule, SurfelSize, bake};
use forest_raster::Surfaces;
use forest_soup::TriangleSoup;
use forest_views::Lookup;
use std::borrow::Cow;

/// Packs and meshes that contenders draw.
pub struct Baselines<'s> {
    area: Pack,
    paper: Pack,
    clustering: Pack,
    levels: Vec<(f64, Cow<'s, TriangleSoup>)>,
    full: Vec<(f64, Cow<'s, TriangleSoup>)>,
    surfaces: Surfaces,
}

/// Shares of triangles that the mesh simplifier is asked for.
const MESH_SHARES: [f64; 6] = [0.5, 0.2, 0.1, 0.05, 0.02, 0.01];

/// k over s_m of the paper's rules: the most that leaves no negative threshold at the front.
const PAPER_BIAS: f64 = 1.0;

impl<'s> Baselines<'s> {
    /// Bakes and simplifies `soup` with the surfels of `block`.
    ///
    /// # Errors
    /// When a bake fails or the temporary folder cannot be written.
    pub fn new(soup: &'s TriangleSoup, block: &PointsBlock) -> Result<Self, EvalError> {
        let h = &block.header;
        let same = BakeOptions {
            grid: GridChoice::Fixed(h.grid),
            surfel_size: if h.surfel_size.is_finite() {
                SurfelSize::Units(h.surfel_size * block.scale())
            } else {
                SurfelSize::Triangle
            },
            alpha_tolerance: h.alpha_tolerance,
            triangles: !block.triangles.is_empty(),
            ..BakeOptions::default()
        };
        let whole = GridChoice::Fixed([1; 3]);
        let area = BakeOptions { radius: RadiusRule::Area, ..same };
        let paper = BakeOptions { radius: RadiusRule::Paper, order: Order::Paper, ..same };
        Ok(Self {
            area: baked(soup, &area)?,
            paper: baked(soup, &paper)?,
            clustering: baked(soup, &BakeOptions { grid: whole, ..area })?,
            levels: MESH_SHARES.map(|share| (share, Cow::Owned(simplified(soup, share)))).into(),
            full: vec![(1.0, Cow::Borrowed(soup))],
            surfaces: Surfaces::new(&soup.materials, &soup.textures),
        })
    }

    /// Opens the baked packs.
    ///
    /// # Errors
    /// When a pack is not sound: that is a bug.
    pub fn blocks(&self) -> Result<[PointsBlock<'_>; 3], EvalError> {
        Ok([
            PointsBlock::open(&self.area)?,
            PointsBlock::open(&self.paper)?,
            PointsBlock::open(&self.clustering)?,
        ])
    }

    /// The pack's block without its calibration, if it has one.
    pub fn raw<'a>(block: &PointsBlock<'a>) -> Option<PointsBlock<'a>> {
        block.calibration.is_some().then(|| PointsBlock { calibration: None, ..block.clone() })
    }

    /// The pack's own contenders and all others; `raw` is [`Baselines::raw`] of `block`. `surfaces` are those of the pack's triangles,
    /// `None` if it has none.
    pub fn contenders<'a>(
        &'a self,
        block: &'a PointsBlock<'a>,
        raw: Option<&'a PointsBlock<'a>>,
        surfaces: Option<&'a Surfaces>,
        [area, paper, clustering]: &'a [PointsBlock<'a>; 3],
    ) -> Vec<Contender<'a>> {
        let points = |name, what, block, bias, look| Contender {
            name,
            what,
            way: Way::Points { block, surfaces, bias, look },
        };
        let mut all = own_contenders(block, surfaces);
        let what = "the pack with depth bias k = s_m/4: coarser behind, finer in front";
        all.push(points("bias-1/4", what, block, 0.25, Look::Translucent));
        let what = "the pack with depth bias k = s_m";
        all.push(points("bias-1", what, block, 1.0, Look::Translucent));
        let what = "the pack without its calibration";
        all.extend(raw.map(|raw| points("raw", what, raw, 0.0, Look::Translucent)));
        all.extend([
            points(
                "area",
                "as raw, but clusters keep the sum of their surfels' areas, hidden or not",
                area,
                0.0,
                Look::Translucent,
            ),
            points(
                "opaque",
                "as area, but points are opaque and as much smaller",
                area,
                0.0,
                Look::Opaque,
            ),
            points(
                "paper",
                "radius and order of Gilet, Meyer, Neyret 2005, depth bias k = s_m",
                paper,
                PAPER_BIAS,
                Look::Translucent,
            ),
            points(
                "clustering",
                "uniform clustering of the whole block without a grid (after Pauly et al. 2002), \
                 opaque points that keep their area",
                clustering,
                0.0,
                Look::Opaque,
            ),
            Contender {
                name: "random",
                what: "a random part of the finest points, enlarged to keep their area (Cook et al. \
                       2007)",
                way: Way::RandomPoints { block },
            },
            Contender {
                name: "simplify",
                what: "triangles by meshoptimizer's simplify with pruning, no error limit",
                way: Way::Meshes { levels: &self.levels, surfaces: &self.surfaces },
            },
            Contender {
                name: "mesh",
                what: "all triangles of the source",
                way: Way::Meshes { levels: &self.full, surfaces: &self.surfaces },
            },
        ]);
        all
    }
}

/// The pack, and its triangles if it has some.
pub fn own_contenders<'a>(
    block: &'a PointsBlock<'a>,
    surfaces: Option<&'a Surfaces>,
) -> Vec<Contender<'a>> {
    let way = Way::Points { block, surfaces, bias: 0.0, look: Look::Translucent };
    let mut own = vec![Contender { name: "pack", what: "the pack as it is drawn, k = 0", way }];
    if let Some(surfaces) = surfaces {
        let way = Way::Triangles { block, surfaces };
        own.push(Contender { name: "triangles", what: "the pack's triangles, no points", way });
    }
    own
}

/// The pack's views, looked up in every way that its channels allow; `levels` finest first.
pub fn views_contenders<'a>(levels: &'a [ViewsLevel<'a>]) -> Vec<Contender<'a>> {
    let Some(first) = levels.first() else { return vec![] };
    let deep = first.block().header.channels.depth;
    let named = |lookup| match lookup {
        Lookup::Nearest => ("views", "the view whose direction is nearest"),
        Lookup::Blend => ("views-blend", "the three views around, by their shares"),
        Lookup::Depth => ("views-depth", "the three views around, followed through their depth"),
    };
    let ways = Lookup::ALL.into_iter().filter(|l| *l != Lookup::Depth || deep);
    ways.map(|lookup| {
        let (name, what) = named(lookup);
        Contender { name, what, way: Way::Views { levels, lookup } }
    })
    .collect()
}

/// A pack's volume, level by level.
pub fn volume_contenders<'a>(scene: Option<&'a VolumeScene<'a>>) -> Vec<Contender<'a>> {
    let named = |scene| Contender {
        name: "volume",
        what: "the volume, one level of it, two cameras blended",
        way: Way::Volume { scene, only: None },
    };
    scene.map(named).into_iter().collect()
}

/// A pack's foliage, level by level.
pub fn foliage_contenders<'a>(scene: Option<&'a FoliageScene<'a>>) -> Vec<Contender<'a>> {
    let named = |scene| Contender {
        name: "foliage",
        what: "the foliage at rest, one level of it: tubes, sheets and cards",
        way: Way::Foliage { scene },
    };
    scene.map(named).into_iter().collect()
}

fn baked(soup: &TriangleSoup, options: &BakeOptions) -> Result<Pack, EvalError> {
    let dir = tempfile::tempdir().map_err(EvalError::Temporary)?;
    let path = dir.path().join("baseline.fpack");
    let mut writer = PackWriter::create(&path)?;
    bake(soup, options, &mut writer, &|_| {})?;
    writer.finish()?;
    // The map outlives the file's name.
    Ok(Pack::open(&path)?)
}

/// What meshoptimizer keeps of each material's triangles when asked for `share` of them.
fn simplified(soup: &TriangleSoup, share: f64) -> TriangleSoup {
    let positions: &[u8] = bytemuck::cast_slice(&soup.positions);
    let vertices = meshopt::VertexDataAdapter::new(positions, 12, 0).expect("12 bytes a position");
    let finite = |t: &[u32; 3]| t.iter().all(|&v| soup.positions[v as usize].is_finite());
    let (mut triangles, mut materials) = (Vec::new(), Vec::new());
    for m in 0..soup.materials.len() as u16 {
        let of_material = soup.triangles.iter().zip(&soup.triangle_materials);
        let indices: Vec<u32> = of_material
            .filter(|(t, material)| **material == m && finite(t))
            .flat_map(|(t, _)| *t)
            .collect();
        if indices.is_empty() {
            continue;
        }
        let target = (indices.len() as f64 / 3.0 * share).ceil() as usize * 3;
        let options = meshopt::SimplifyOptions::Prune;
        let kept = meshopt::simplify(&indices, &vertices, target, f32::MAX, options, None);
        materials.extend(std::iter::repeat_n(m, kept.len() / 3));
        triangles.extend(kept.as_chunks::<3>().0);
    }
    with_triangles(soup, triangles, materials)
}

/// A soup of some of another's triangles, with the vertices that they use.
fn with_triangles(
    soup: &TriangleSoup,
    mut triangles: Vec<[u32; 3]>,
    triangle_materials: Vec<u16>,
) -> TriangleSoup {
    let mut places = vec![u32::MAX; soup.positions.len()];
    let mut used: Vec<usize> = Vec::new();
    for v in triangles.as_flattened_mut() {
        let place = &mut places[*v as usize];
        if *place == u32::MAX {
            *place = used.len() as u32;
            used.push(*v as usize);
        }
        *v = *place;
    }
    fn pick<T: Copy>(from: &[T], used: &[usize]) -> Vec<T> {
        if from.is_empty() { vec![] } else { used.iter().map(|&v| from[v]).collect() }
    }
    TriangleSoup {
        origin: soup.origin,
        positions: pick(&soup.positions, &used),
        normals: pick(&soup.normals, &used),
        uvs: pick(&soup.uvs, &used),
        colors: pick(&soup.colors, &used),
        sunlit: pick(&soup.sunlit, &used),
        skylit: pick(&soup.skylit, &used),
        triangles,
        triangle_materials,
        materials: soup.materials.clone(),
        textures: soup.textures.clone(),
    }
}
