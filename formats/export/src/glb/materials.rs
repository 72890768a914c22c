//! Materials and pictures of a glb.

use crate::ExportError;
use crate::glb::buffer::Binary;
use crate::picture::{check_size, png};
use forest_soup::{AlphaMode, Material, Texture, Wrap};
use image::{DynamicImage, RgbImage, RgbaImage};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Materials, textures, images and samplers of a document.
#[derive(Default)]
pub(crate) struct Materials {
    pub(crate) materials: Vec<Value>,
    pub(crate) textures: Vec<Value>,
    pub(crate) images: Vec<Value>,
    pub(crate) samplers: Vec<Value>,
    /// Extensions of materials.
    pub(crate) used: BTreeSet<&'static str>,
}

impl Materials {
    /// A picture with straight alpha, or without any; the number of its texture.
    pub(crate) fn texture(
        &mut self,
        binary: &mut Binary,
        texture: &Texture,
        opaque: bool,
    ) -> Result<usize, ExportError> {
        let Texture { width, height, texels, .. } = texture;
        check_size(*width, *height)?;
        let fits = "as many texels as width times height";
        let image: DynamicImage = if opaque {
            let bytes = texels.iter().flat_map(|t| [t[0], t[1], t[2]]).collect();
            RgbImage::from_raw(*width, *height, bytes).expect(fits).into()
        } else {
            RgbaImage::from_raw(*width, *height, texels.as_flattened().to_vec()).expect(fits).into()
        };
        let view = binary.view(&png(image)?, None);
        self.images.push(json!({
            "name": texture.name, "bufferView": view, "mimeType": "image/png",
        }));
        let [s, t] = texture.wrap.map(|w| match w {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        });
        // Linear, between mips too.
        let sampler = json!({ "wrapS": s, "wrapT": t, "magFilter": 9729, "minFilter": 9987 });
        let known = self.samplers.iter().position(|k| *k == sampler);
        let number = known.unwrap_or_else(|| {
            self.samplers.push(sampler);
            self.samplers.len() - 1
        });
        self.textures.push(json!({ "source": self.images.len() - 1, "sampler": number }));
        Ok(self.textures.len() - 1)
    }

    /// Gives material `number` a normal texture.
    pub(crate) fn relief(&mut self, number: usize, texture: usize, scale: f32) {
        self.materials[number]["normalTexture"] =
            json!({ "index": texture, "scale": f64::from(scale) });
    }

    /// A matt material with the picture of that number; its own number.
    pub(crate) fn material(&mut self, material: &Material, texture: Option<usize>) -> usize {
        let mut matt = json!({
            "baseColorFactor": material.base_color.map(f64::from),
            "metallicFactor": 0.0,
            "roughnessFactor": 1.0,
        });
        if let Some(texture) = texture {
            matt["baseColorTexture"] = json!({ "index": texture });
        }
        let mut value = json!({
            "name": material.name,
            "pbrMetallicRoughness": matt,
            "doubleSided": material.double_sided,
        });
        match material.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask { cutoff } => {
                value["alphaMode"] = "MASK".into();
                value["alphaCutoff"] = f64::from(cutoff).into();
            }
            AlphaMode::Blend => value["alphaMode"] = "BLEND".into(),
        }
        if material.unlit {
            value["extensions"] = json!({ "KHR_materials_unlit": {} });
            self.used.insert("KHR_materials_unlit");
        } else if material.translucency < 1.0 {
            // As it is imported; what is not told of translucency stays untold.
            let share = material.translucency / (1.0 + material.translucency);
            let [r, g, b, _] = material.base_color.map(f64::from);
            let mut own = json!({
                "diffuseTransmissionFactor": f64::from(share),
                "diffuseTransmissionColorFactor": [r, g, b],
            });
            if let Some(texture) = texture {
                own["diffuseTransmissionColorTexture"] = json!({ "index": texture });
            }
            value["extensions"] = json!({ "KHR_materials_diffuse_transmission": own });
            self.used.insert("KHR_materials_diffuse_transmission");
        }
        self.materials.push(value);
        self.materials.len() - 1
    }
}
