//! The golden packs: what they are made of. `make golden` writes them; tests only read them.

use crate::bake_bytes;
use crate::soups::{leaves, texture, textured};
use forest_points::{BakeOptions, GridChoice, Order, RadiusRule, SurfelSize};
use forest_soup::{AlphaMode, TriangleSoup};
use std::path::PathBuf;

/// One golden pack.
pub struct Golden {
    /// File name in `tests/golden`.
    pub name: &'static str,
    soup: TriangleSoup,
    options: BakeOptions,
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
        bake_bytes(&self.soup, &self.options).expect("a golden soup bakes").0
    }
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
    vec![
        Golden {
            name: "textured.fpack",
            soup: textured(leaves(150, 0.2, 1), leaf, mask),
            options: cut,
        },
        Golden { name: "vertex-colours.fpack", soup: colored, options: cut },
        Golden {
            name: "paper.fpack",
            soup: leaves(300, 0.1, 3),
            options: BakeOptions {
                radius: RadiusRule::Paper,
                order: Order::Paper,
                triangles: false,
                ..cut
            },
        },
        Golden {
            name: "one-triangle.fpack",
            soup: leaves(1, 0.5, 4),
            options: BakeOptions { surfel_size: SurfelSize::Triangle, ..cut },
        },
    ]
}
