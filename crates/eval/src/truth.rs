//! The pictures that everything is judged against.

use crate::error::EvalError;
use crate::frame::{Frame, View};
use forest_raster::{Light, Picture, RayScene, Style, Surfaces, rasterize};
use forest_soup::TriangleSoup;

/// The tree's truth, ready to be drawn.
pub struct Truth<'a> {
    soup: &'a TriangleSoup,
    surfaces: &'a Surfaces,
    rays: Option<RayScene<'a>>,
    style: Style,
    /// Its place and size.
    pub frame: Frame,
}

impl<'a> Truth<'a> {
    /// Truth by scanlines; by rays where light throws shadows.
    ///
    /// # Errors
    /// When the soup is invalid or has no extent.
    pub fn new(
        soup: &'a TriangleSoup,
        surfaces: &'a Surfaces,
        style: Style,
    ) -> Result<Self, EvalError> {
        soup.validate()?;
        let frame = Frame::of(soup).ok_or(EvalError::NothingToSee)?;
        let rays = match style.light {
            Light::Albedo => None,
            Light::Sun(_) => Some(RayScene::new(soup, surfaces)),
        };
        Ok(Self { soup, surfaces, rays, style, frame })
    }

    /// The tree `height` pixels high from `view`, in a picture of `side` pixels.
    pub fn picture(&self, view: &View, height: f64, side: u32) -> Picture {
        let camera = self.frame.camera(view, height, side);
        match &self.rays {
            Some(rays) => rays.picture(&camera, &self.style),
            None => rasterize(self.soup, self.surfaces, &camera, &self.style),
        }
    }

    /// Side of the pictures of a sweep: they show the tree at `heights[0]`, and can be filtered to
    /// all others.
    pub(crate) fn side(&self, heights: &[u32]) -> u32 {
        let multiple = heights.iter().map(|h| heights[0] / h).fold(1, lcm);
        self.frame.side(f64::from(heights[0]), multiple)
    }
}

fn lcm(a: u32, b: u32) -> u32 {
    let gcd = |mut a: u32, mut b: u32| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    a / gcd(a, b) * b
}
