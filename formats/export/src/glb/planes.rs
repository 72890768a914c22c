//! The last level of a glb: views on crossed planes, for readers without an impostor's shader.

use crate::ExportError;
use crate::engine::keyed;
use crate::glb::buffer::Binary;
use crate::glb::materials::Materials;
use crate::grid::WholeTiles;
use crate::picture::check_size;
use forest_soup::{AlphaMode, Material, Texture, Wrap};
use forest_views::{ViewsBlock, normal_parts};
use glam::DVec3;
use serde_json::{Value, json};

/// From the front, from the side, and from above, as far as there are views of these.
const FROM: [DVec3; 3] = [DVec3::Z, DVec3::X, DVec3::Y];

/// Alpha from which a texel is shown.
const CUTOFF: f32 = 0.5;

/// Views on their way into a glb.
pub(crate) struct Planes<'a> {
    block: &'a ViewsBlock<'a>,
    /// Level of the views whose texels these are.
    level: usize,
}

impl<'a> Planes<'a> {
    /// Those of the coarsest level whose texels are at least as fine as `texel` world units, else of the
    /// finest.
    pub(crate) fn new(block: &'a ViewsBlock<'a>, texel: f64) -> Self {
        let fine = |l: usize| Self { block, level: l }.texel() <= texel;
        let level = (0..block.header.levels.len()).rev().find(|l| fine(*l)).unwrap_or(0);
        Self { block, level }
    }

    /// World units of a texel.
    fn texel(&self) -> f64 {
        2.0 * self.block.header.half / f64::from(self.block.header.levels[self.level].texels)
    }

    /// The views that are shown, each once.
    fn views(&self) -> Vec<u32> {
        let mut views = Vec::new();
        for view in FROM.iter().map(|d| self.block.directions().nearest(*d)) {
            if !views.contains(&view) {
                views.push(view);
            }
        }
        views
    }

    /// Number of triangles.
    pub(crate) fn triangles(&self) -> usize {
        2 * self.views().len()
    }

    /// Adds the planes; the mesh.
    pub(crate) fn mesh(
        &self,
        name: &str,
        place: DVec3,
        binary: &mut Binary,
        out: &mut Materials,
    ) -> Result<Value, ExportError> {
        let views = self.views();
        let (half, center) = (self.block.header.half, self.block.center() - place);
        let [mut positions, mut normals] = [Vec::new(), Vec::new()];
        let (mut tangents, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for (i, &view) in (0u32..).zip(&views) {
            let frame = &self.block.frames[view as usize];
            for [x, y] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                let corner = frame.right * (2.0 * x - 1.0) + frame.up * (1.0 - 2.0 * y);
                positions.push((center + corner * half).as_vec3().to_array());
                normals.push(frame.back.as_vec3().to_array());
                tangents.push(frame.right.as_vec3().extend(1.0).to_array());
                uvs.push([((f64::from(i) + x) / views.len() as f64) as f32, y as f32]);
            }
            triangles.extend([[0, 2, 3], [0, 3, 1]].map(|t: [u32; 3]| t.map(|v| 4 * i + v)));
        }
        let [color, normal] = self.pictures(&views)?;
        let color = out.texture(binary, &color, false)?;
        let material = Material {
            name: name.into(),
            alpha_mode: AlphaMode::Mask { cutoff: CUTOFF },
            double_sided: true,
            ..Material::default()
        };
        let material = out.material(&material, Some(color));
        if self.block.header.channels.normal {
            let normal = out.texture(binary, &normal, true)?;
            out.relief(material, normal, 1.0);
        }
        let attributes = json!({
            "POSITION": binary.positions(&positions),
            "NORMAL": binary.floats(&normals),
            "TANGENT": binary.floats(&tangents),
            "TEXCOORD_0": binary.floats(&uvs),
        });
        let indices = binary.indices(&triangles);
        let primitive =
            json!({ "attributes": attributes, "indices": indices, "material": material });
        Ok(json!({ "name": name, "primitives": [primitive] }))
    }

    /// Colour, and normals in the frames of the planes: tiles side by side.
    fn pictures(&self, views: &[u32]) -> Result<[Texture; 2], ExportError> {
        let tiles = WholeTiles::read(self.block, self.level)?;
        let (side, width) = (tiles.side, tiles.side * views.len() as u32);
        check_size(width, side)?;
        let texture = |name: &str| Texture {
            name: name.into(),
            width,
            height: side,
            texels: vec![[0; 4]; width as usize * side as usize],
            wrap: [Wrap::Clamp; 2],
        };
        let (mut color, mut normal) = (texture("views"), texture("normals of views"));
        for (i, &view) in (0..).zip(views) {
            let cutoff = f32::from(tiles.cutoff(view)) / 255.0;
            for (x, y, texel) in tiles.texels(view) {
                let at = (y * width + i * side + x) as usize;
                let [r, g, b, a] = texel.color;
                color.texels[at] = [r, g, b, keyed(a, cutoff, CUTOFF)];
                let parts = normal_parts(texel.normal);
                let [nx, ny, nz] = parts.map(|v| ((v * 0.5 + 0.5) * 255.0).round() as u8);
                normal.texels[at] = [nx, ny, nz, 255];
            }
        }
        Ok([color, normal])
    }
}
