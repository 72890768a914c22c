//! Pictures compared.

use forest_raster::Picture;

/// Root mean square difference over the box around what either shows; 0 for nothing.
///
/// # Panics
/// If they are not of one size.
pub fn rmse(a: &Picture, b: &Picture) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let shown = |i: usize| a.pixels[i][3] > 0.0 || b.pixels[i][3] > 0.0;
    let places: Vec<[usize; 2]> = (0..a.pixels.len())
        .filter(|&i| shown(i))
        .map(|i| [i % a.width as usize, i / a.width as usize])
        .collect();
    let end = |k: usize| places.iter().map(|p| p[k] + 1).max().unwrap_or(0);
    let start = |k: usize| places.iter().map(|p| p[k]).min().unwrap_or(0);
    let (mut sum, mut count) = (0.0, 0usize);
    for y in start(1)..end(1) {
        for x in start(0)..end(0) {
            let i = y * a.width as usize + x;
            sum += (0..4).map(|k| f64::from(a.pixels[i][k] - b.pixels[i][k]).powi(2)).sum::<f64>();
            count += 4;
        }
    }
    (sum / count.max(1) as f64).sqrt()
}
