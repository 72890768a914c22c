//! The golden packs: what they are made of. `make golden` writes them; tests only read them.

use crate::soups::{bumpy_tree, leaves, small_tree, texture, textured};
use crate::{bake_bytes, bake_foliage, bake_views, bake_volume, merged, open};
use forest_foliage::FoliageOptions;
use forest_pack::measures::{Light, Measure, Measures};
use forest_pack::{PackError, PackWriter, kind};
use forest_points::{BakeOptions, Calibration, GridChoice, Order, RadiusRule, SurfelSize};
use forest_soup::{AlphaMode, TriangleSoup};
use forest_views::{Directions, Dome, Quality, ViewsOptions};
use forest_volume::{CodebookOptions, CodebookSize, Stand, VolumeOptions};
use std::path::PathBuf;

/// One golden pack.
pub struct Golden {
    /// File name in `tests/golden`.
    pub name: &'static str,
    soup: TriangleSoup,
    content: Content,
}

/// What a golden pack holds.
enum Content {
    /// Points; `measured` ones with a calibration and a measured table, both made up.
    Points { options: BakeOptions, measured: bool },
    /// Views, and nothing else.
    Views(ViewsOptions),
    /// Foliage, and nothing else.
    Foliage(FoliageOptions),
    /// Points and foliage, the points tied to its branches.
    Tree(BakeOptions, FoliageOptions),
    /// A volume, and nothing else.
    Volume(VolumeOptions, CodebookOptions),
}

/// No golden pack is larger.
pub const MAX_BYTES: usize = 64 << 10;

impl Golden {
    /// Where the pack is committed.
    pub fn path(&self) -> PathBuf {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden").join(self.name)
    }

    /// The pack as this build bakes it.
    ///
    /// # Panics
    /// When it cannot be baked: that is a bug.
    pub fn bake(&self) -> Vec<u8> {
        match &self.content {
            Content::Points { options, measured } => {
                let bytes = bake_bytes(&self.soup, options).expect("a golden soup bakes").0;
                if *measured { with_measures(&bytes).expect("a golden pack") } else { bytes }
            }
            Content::Views(options) => {
                bake_views(&self.soup, options).expect("a golden soup bakes")
            }
            Content::Foliage(options) => {
                bake_foliage(&self.soup, options).expect("a golden soup bakes").0
            }
            Content::Tree(points, foliage) => {
                let points = bake_bytes(&self.soup, points).expect("a golden soup bakes").0;
                let foliage = bake_foliage(&self.soup, foliage).expect("a golden soup bakes").0;
                merged(&[foliage, points])
            }
            Content::Volume(options, codebook) => {
                let stand = Stand::Dome { cameras: 5 };
                let baked = bake_volume(&self.soup, stand, options, Some(codebook));
                baked.expect("a golden soup bakes").0
            }
        }
    }
}

/// The pack with a calibration and a measured table.
fn with_measures(bytes: &[u8]) -> Result<Vec<u8>, PackError> {
    let pack = open(bytes)?;
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("t.fpack");
    let mut writer = PackWriter::create(&path)?;
    for (id, _) in pack.sections() {
        writer.copy(&pack, id)?;
    }
    let factors = std::array::from_fn(|i| 0.9 + i as f32 / 256.0);
    Calibration::new(factors).write(&mut writer)?;
    let row = |s_m: f32, pixel_height: f32, elevation: [f32; 2]| Measure {
        representation: kind::POINTS_HEADER,
        level: [s_m, 16.0 * s_m, 0.0],
        pixel_height,
        elevation,
        light: Light::Albedo,
        primitives: 512.0 / s_m,
        bytes: 8192.0 / s_m,
        rmse: 0.03125,
        rmse_worst: 0.0625,
        flip: 0.046875 * s_m,
        flip_worst: 0.0625 * s_m,
        ssim: 0.875,
        coverage: -0.0078125,
    };
    let rows = [64.0, 16.0]
        .into_iter()
        .flat_map(|h| [row(1.0, h, [-6.0, 20.0]), row(4.0, h, [-6.0, 20.0])])
        .collect();
    Measures { method: "made up".into(), rows }.write(&mut writer)?;
    writer.finish()?;
    Ok(std::fs::read(&path).expect("the pack that was just written"))
}

/// The golden pack with the most kinds of sections.
pub fn richest() -> Golden {
    all().pop().expect("there are golden packs")
}

/// All golden packs.
pub fn all() -> Vec<Golden> {
    let leaf = texture(16, |x, y| {
        let inside = (x as f32 - 7.5).hypot(y as f32 - 7.5) < 7.0;
        [40 + 8 * x as u8, 160, 20, if inside { 255 } else { 0 }]
    });
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    let mut colored = textured(leaves(120, 0.2, 2), leaf.clone(), mask);
    colored.colors = (0..360).map(|i| [1.0, (i % 7) as f32 / 7.0, 0.5, 1.0]).collect();
    let cut = BakeOptions {
        surfel_size: SurfelSize::Units(0.1),
        grid: GridChoice::Budget(8),
        ..BakeOptions::default()
    };
    let points = |name, soup, options| Golden {
        name,
        soup,
        content: Content::Points { options, measured: false },
    };
    let paper =
        BakeOptions { radius: RadiusRule::Paper, order: Order::Paper, triangles: false, ..cut };
    let single = BakeOptions { surfel_size: SurfelSize::Triangle, ..cut };
    // Without blocks, whose encoder may round otherwise on another processor.
    let views = ViewsOptions {
        directions: Directions::octahedral(9, Dome::Upper),
        texels: 16,
        quality: Quality::Lossless,
        ..ViewsOptions::default()
    };
    let foliage = FoliageOptions {
        texel: Some(0.15),
        levels: 2,
        // Without blocks, as views.
        blocks: false,
        ..FoliageOptions::default()
    };
    vec![
        points("textured.fpack", textured(leaves(150, 0.2, 1), leaf.clone(), mask), cut),
        points("vertex-colours.fpack", colored.clone(), cut),
        points("paper.fpack", leaves(300, 0.1, 3), paper),
        points("one-triangle.fpack", leaves(1, 0.5, 4), single),
        Golden {
            name: "views.fpack",
            soup: textured(leaves(60, 0.3, 5), leaf.clone(), mask),
            content: Content::Views(views),
        },
        Golden {
            name: "volume.fpack",
            soup: textured(leaves(60, 0.3, 6), leaf, mask),
            content: Content::Volume(
                VolumeOptions { levels: 3, ..VolumeOptions::default() },
                CodebookOptions { size: CodebookSize::Words(40), ..CodebookOptions::default() },
            ),
        },
        Golden {
            name: "foliage.fpack",
            soup: small_tree(),
            content: Content::Foliage(foliage.clone()),
        },
        Golden {
            name: "measured.fpack",
            soup: colored,
            content: Content::Points { options: cut, measured: true },
        },
        Golden { name: "tree.fpack", soup: bumpy_tree(), content: Content::Tree(single, foliage) },
    ]
}
