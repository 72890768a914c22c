//! Panels: flat or bent sheets that show what lies near them, and the pictures on them.

use crate::leaf::{Card, Leaf, flat_corners};
use forest_raster::{Light, Picture, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::{DMat3, DVec2, DVec3};

/// A sheet with a picture.
#[derive(Clone, Debug)]
pub(crate) struct Panel {
    /// Middle of the sheet's rectangle.
    pub(crate) center: DVec3,
    /// Right, up and normal: a right-handed frame.
    pub(crate) axes: DMat3,
    /// Texels across and down.
    pub(crate) size: [u32; 2],
    /// World units of a texel.
    pub(crate) texel: f64,
    /// Cells across and down; 1 × 1 is a card.
    pub(crate) cells: [u32; 2],
    /// Heights over the plane of the grid's corners, row by row from the top left one; empty for
    /// a flat sheet.
    pub(crate) heights: Vec<f64>,
    /// What it shows, row 0 on top: linear RGB premultiplied by coverage, and coverage.
    pub(crate) pixels: Vec<[f32; 4]>,
}

/// Samples along the side of a texel.
const SAMPLES: u32 = 4;

/// Texels that a panel has at most along a side.
pub(crate) const MOST_TEXELS: u32 = 1024;

/// Triangles as a panel shows them: corners about its centre along right, up and normal.
pub(crate) struct Flat<'a> {
    pub(crate) soup: &'a TriangleSoup,
    /// Numbers in the soup.
    pub(crate) triangles: Vec<u32>,
    /// Three a triangle.
    pub(crate) corners: Vec<DVec3>,
}

impl Flat<'_> {
    /// Smallest and largest corner in the plane.
    pub(crate) fn rectangle(&self) -> (DVec2, DVec2) {
        self.corners.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(min, max), p| {
            (min.min(p.truncate()), max.max(p.truncate()))
        })
    }

    /// The picture of the rectangle of `size` texels about `middle`, seen along the normal.
    pub(crate) fn picture(
        &self,
        surfaces: &Surfaces,
        middle: DVec2,
        size: [u32; 2],
        texel: f64,
    ) -> Picture {
        let source = self.soup;
        let vertices = || self.triangles.iter().flat_map(|&i| source.triangles[i as usize]);
        let soup = TriangleSoup {
            positions: self.corners.iter().map(|p| p.as_vec3()).collect(),
            uvs: vertices().filter_map(|v| source.uvs.get(v as usize).copied()).collect(),
            colors: vertices().filter_map(|v| source.colors.get(v as usize).copied()).collect(),
            triangles: (0..self.triangles.len() as u32)
                .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
                .collect(),
            triangle_materials: self
                .triangles
                .iter()
                .map(|&i| source.triangle_materials[i as usize])
                .collect(),
            ..TriangleSoup::default()
        };
        let camera = Camera {
            eye: middle.extend(0.0),
            right: DVec3::X,
            up: DVec3::Y,
            forward: DVec3::NEG_Z,
            projection: Projection::Orthographic { height: f64::from(size[1]) * texel },
            width: size[0],
            height: size[1],
        };
        let sampling = Sampling { side: SAMPLES, seed: 1 };
        rasterize(&soup, surfaces, &camera, &Style { sampling, light: Light::Albedo })
    }
}

impl Panel {
    /// The panel of a card, with texels of this size; `None` if nothing of it would be seen.
    pub(crate) fn of_card(
        soup: &TriangleSoup,
        surfaces: &Surfaces,
        leaves: &[Leaf],
        card: &Card,
        texel: f64,
    ) -> Option<Self> {
        let to_card = card.axes.transpose();
        let mut flat = Flat { soup, triangles: Vec::new(), corners: Vec::new() };
        for &i in &card.leaves {
            let leaf = &leaves[i as usize];
            flat.triangles.extend(&leaf.triangles);
            let corners = flat_corners(soup, leaf, card.axes.z_axis);
            flat.corners.extend(corners.map(|p| to_card * (p - card.center)));
        }
        Self::of(&flat, surfaces, card.center, card.axes, texel)
    }

    /// The flat panel of `flat`, about `center`.
    pub(crate) fn of(
        flat: &Flat,
        surfaces: &Surfaces,
        center: DVec3,
        axes: DMat3,
        texel: f64,
    ) -> Option<Self> {
        let (min, max) = flat.rectangle();
        let texels = |v: f64| ((v / texel).ceil() as u32).clamp(1, MOST_TEXELS);
        let size = [texels(max.x - min.x), texels(max.y - min.y)];
        let middle = 0.5 * (min + max);
        let pixels = flat.picture(surfaces, middle, size, texel).pixels;
        let seen = pixels.iter().any(|p| p[3] > 0.0);
        let center = center + axes * middle.extend(0.0);
        let cells = [1, 1];
        seen.then_some(Self { center, axes, size, texel, cells, heights: vec![], pixels })
    }

    /// Half the width and height.
    pub(crate) fn half(&self) -> DVec2 {
        DVec2::new(f64::from(self.size[0]), f64::from(self.size[1])) * (0.5 * self.texel)
    }

    /// Corner (i, j) of the grid: where it is, and its place in the picture, `0..=1` from the top left.
    pub(crate) fn corner(&self, i: u32, j: u32) -> (DVec3, DVec2) {
        let at = DVec2::new(
            f64::from(i) / f64::from(self.cells[0]),
            f64::from(j) / f64::from(self.cells[1]),
        );
        let half = self.half();
        let height =
            self.heights.get((j * (self.cells[0] + 1) + i) as usize).copied().unwrap_or(0.0);
        let local = DVec3::new((2.0 * at.x - 1.0) * half.x, (1.0 - 2.0 * at.y) * half.y, height);
        (self.center + self.axes * local, at)
    }

    /// All corners of the grid, row by row.
    pub(crate) fn corners(&self) -> impl Iterator<Item = (DVec3, DVec2)> {
        let [m, n] = self.cells;
        (0..=n).flat_map(move |j| (0..=m).map(move |i| self.corner(i, j)))
    }
}
