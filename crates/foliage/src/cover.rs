//! Cards as large as they must be: together they cover what the source covers.
//!
//! Leaves of one card hide each other where those of the source lie before and behind each other, and cards
//! stand apart where leaves stood close. Both change with the level. What is missing, or too much, is made
//! good by the size of the cards, about their middles.

use crate::fit::Brightness;
use crate::header::VertexRecord;
use forest_raster::Surfaces;
use forest_soup::TriangleSoup;
use glam::Vec3;

/// No card grows or shrinks by more.
const SIZES: std::ops::RangeInclusive<f32> = 0.85..=1.2;

/// Steps of the search; each leaves less than half of the error.
const STEPS: usize = 3;

/// Corners of a card, which follow each other.
const CORNERS: usize = 4;

/// Scales the cards among `vertices` so that `level`, the same as a soup, covers as much as the truth. `first`
/// is the first vertex that is not wood; sheets keep their size.
pub(crate) fn cover(
    truth: &Brightness,
    level: &mut TriangleSoup,
    surfaces: &Surfaces,
    vertices: &mut [VertexRecord],
    first: usize,
    pivot_step: f64,
) {
    let cards: Vec<usize> =
        (first..vertices.len()).filter(|v| vertices[*v].flutter > 0).step_by(CORNERS).collect();
    let (mut size, mut best) = (1.0f32, (f64::INFINITY, 1.0f32));
    for _ in 0..=STEPS {
        scale(level, vertices, &cards, size);
        let missing = truth.coverage_over(level, surfaces);
        let off = (missing - 1.0).abs();
        if !missing.is_finite() || off >= best.0 {
            break;
        }
        best = (off, size);
        // Area grows with the square of the size, coverage less.
        size = (size * missing as f32).clamp(*SIZES.start(), *SIZES.end());
    }
    scale(level, vertices, &cards, best.1);
    for &card in &cards {
        for (v, place) in (card..).zip(&level.positions[card..card + CORNERS]) {
            let v = &mut vertices[v];
            let moved = (Vec3::from(v.position) - *place).as_dvec3() / pivot_step;
            v.pivot = [0, 1, 2].map(|k| {
                let limit = f64::from(i16::MAX);
                (f64::from(v.pivot[k]) + moved[k]).round().clamp(-limit, limit) as i16
            });
            v.position = place.to_array();
        }
    }
}

/// The cards of `vertices` in `level`, `size` times as large.
fn scale(level: &mut TriangleSoup, vertices: &[VertexRecord], cards: &[usize], size: f32) {
    for &card in cards {
        let corners = &vertices[card..card + CORNERS];
        let middle = corners.iter().map(|v| Vec3::from(v.position)).sum::<Vec3>() / CORNERS as f32;
        for (to, v) in level.positions[card..].iter_mut().zip(corners) {
            *to = middle + (Vec3::from(v.position) - middle) * size;
        }
    }
}
