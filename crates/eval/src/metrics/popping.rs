//! Error in time.

use super::{PixelBox, pixels};
use forest_raster::Picture;

/// What the picture changes over a camera's step and the truth does not: the root mean square of
/// (test₁ − test₀) − (truth₁ − truth₀), premultiplied linear RGBA, over the box that holds what any
/// of the four pictures shows.
///
/// A level that follows the truth but for its constant error has 0; what moves with the camera
/// otherwise than the truth does, or pops, has more. Whether it is a switch of level tells the same
/// measure for one and the same cut.
///
/// # Panics
/// If their sizes differ.
pub fn popping(truth: [&Picture; 2], test: [&Picture; 2]) -> f64 {
    let all = [truth[0], truth[1], test[0], test[1]];
    assert!(all.iter().all(|p| (p.width, p.height) == (all[0].width, all[0].height)));
    let b = PixelBox::around(&all);
    let [mut expected, before, after] = [truth[0], truth[1], test[1]].map(|p| b.crop(p));
    // test₀ + (truth₁ − truth₀): what the step should have made of it.
    let start = b.crop(test[0]);
    for i in 0..expected.pixels.len() {
        for c in 0..4 {
            let step = before.pixels[i][c] - expected.pixels[i][c];
            expected.pixels[i][c] = start.pixels[i][c] + step;
        }
    }
    pixels::rmse(&expected, &after)
}
