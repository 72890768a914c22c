//! Error in time.

use super::{PixelBox, pixels};
use forest_raster::Picture;

/// How much more the picture changes over a camera's step than the truth does: the excess of the
/// root mean square change (premultiplied linear RGBA), 0 where it changes less. All four pictures
/// share a size and are compared over the box that holds what any of them shows.
///
/// # Panics
/// If their sizes differ.
pub fn popping(truth: [&Picture; 2], test: [&Picture; 2]) -> f64 {
    let all = [truth[0], truth[1], test[0], test[1]];
    assert!(all.iter().all(|p| (p.width, p.height) == (all[0].width, all[0].height)));
    let b = PixelBox::around(&all);
    let change = |pair: [&Picture; 2]| pixels::rmse(&b.crop(pair[0]), &b.crop(pair[1]));
    (change(test) - change(truth)).max(0.0)
}
