//! A tree simplified by meshoptimizer.

use forest_soup::TriangleSoup;
use glam::Vec3;

/// The soup with about `target` triangles, each material with its share.
pub(crate) fn simplified(soup: &TriangleSoup, target: usize) -> TriangleSoup {
    let bytes: &[u8] = bytemuck::cast_slice(&soup.positions);
    let vertices = meshopt::VertexDataAdapter::new(bytes, size_of::<Vec3>(), 0).expect("positions");
    let share = target as f64 / soup.triangles.len() as f64;
    let mut out = soup.clone();
    (out.triangles, out.triangle_materials) = (Vec::new(), Vec::new());
    for material in 0..soup.materials.len() as u16 {
        let own = soup.triangles.iter().zip(&soup.triangle_materials);
        let indices: Vec<u32> =
            own.filter(|(_, m)| **m == material).flat_map(|(t, _)| *t).collect();
        let most = (indices.len() as f64 / 3.0 * share).round() as usize * 3;
        let options = meshopt::SimplifyOptions::Prune;
        let kept = meshopt::simplify(&indices, &vertices, most, f32::MAX, options, None);
        out.triangles.extend(kept.as_chunks::<3>().0);
        out.triangle_materials.resize(out.triangles.len(), material);
    }
    out
}
