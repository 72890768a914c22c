use crate::{ImportError, Imported, Limits, load};
use base64::Engine;
use forest_soup::{AlphaMode, Model, Relief, Wrap};
use glam::{Vec2, Vec3};
use proptest::prelude::*;
use serde_json::{Value, json};

/// A document with one mesh of one primitive over data-URI bytes; tests change it.
struct Doc {
    json: Value,
    bytes: Vec<u8>,
}

impl Doc {
    fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": {} }] }],
            "accessors": [],
            "bufferViews": [],
            "buffers": [{}],
        });
        Self { json, bytes: Vec::new() }
    }

    /// One right triangle in the XY plane.
    fn triangle() -> Self {
        let mut doc = Self::new();
        let p = doc.floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.], "VEC3");
        doc.primitive()["attributes"]["POSITION"] = json!(p);
        doc
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.bytes.extend(bytes);
        self.push("bufferViews", view)
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, kind: &str) -> usize {
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({
                "bufferView": view, "componentType": component, "count": count, "type": kind,
            }),
        )
    }

    fn floats(&mut self, values: &[f32], kind: &str) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, values.len() / width, kind)
    }

    fn load(self) -> Result<Model, ImportError> {
        self.read().map(|i| i.model)
    }

    fn read(mut self) -> Result<Imported, ImportError> {
        let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.bytes.len());
        self.json["buffers"][0]["uri"] =
            json!(format!("data:application/octet-stream;base64,{data}"));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.gltf");
        std::fs::write(&path, self.json.to_string()).unwrap();
        load(&path, &Limits::default())
    }

    fn refused(self, want: &[&str]) -> ImportError {
        let e = self.load().unwrap_err();
        let text = e.to_string();
        assert!(want.iter().all(|w| text.contains(w)), "{text}");
        e
    }
}

fn positions(model: Model) -> Vec<Vec3> {
    model.flatten(1000).unwrap().positions
}

#[test]
fn indices_of_every_width_and_none() {
    let none = Doc::triangle().load().unwrap();
    assert_eq!(none.meshes[0].triangles, [[0, 1, 2]]);
    for (component, bytes) in [
        (5121, vec![2u8, 1, 0]),
        (5123, vec![2, 0, 1, 0, 0, 0]),
        (5125, vec![2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        let mut doc = Doc::triangle();
        let a = doc.accessor(&bytes, component, 3, "SCALAR");
        doc.primitive()["indices"] = json!(a);
        assert_eq!(doc.load().unwrap().meshes[0].triangles, [[2, 1, 0]], "{component}");
    }
}

#[test]
fn strips_keep_their_winding_and_fans_their_centre() {
    let with_mode = |mode: u32| {
        let mut doc = Doc::new();
        let p = doc.floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 0., 2., 0.], "VEC3");
        *doc.primitive() = json!({ "attributes": { "POSITION": p }, "mode": mode });
        doc.load().unwrap().meshes.first().map(|m| m.triangles.clone())
    };
    assert_eq!(with_mode(5).unwrap(), [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    assert_eq!(with_mode(6).unwrap(), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
    assert_eq!(with_mode(1), None); // lines have no area
}

#[test]
fn nested_transforms_mirrors_and_matrices() {
    let mut doc = Doc::triangle();
    doc.json["nodes"] = json!([
        { "translation": [1e6, 0.25, 0.0], "children": [1] },
        { "scale": [-2.0, 2.0, 2.0], "children": [2] },
        { "matrix": [0,1,0,0, -1,0,0,0, 0,0,1,0, 3,0,0,1], "mesh": 0 },
    ]);
    let model = doc.load().unwrap();
    let place = model.instances[0].placement;
    assert!(place.is_mirrored());
    assert_eq!(place.translation().to_array(), [1e6 - 6.0, 0.25, 0.0]);
    let soup = model.flatten(10).unwrap();
    // (1, 0, 0) turns to (0, 1, 0), scales to (0, 2, 0).
    assert_eq!(soup.positions[1], Vec3::new(0.0, 2.0, 0.0));
    assert_eq!(soup.triangles[0], [0, 2, 1]); // flipped, once
}

#[test]
fn translations_keep_their_f64_digits() {
    let mut doc = Doc::triangle();
    doc.json["nodes"] = json!([{ "mesh": 0, "translation": [1000000.0123, 0, 0] }]);
    let t = doc.load().unwrap().instances[0].placement.translation();
    assert_eq!(t.x, 1000000.0123); // an f32 would say 1000000.0
}

#[test]
fn vertex_colours_materials_and_alpha_modes() {
    let mut doc = Doc::triangle();
    let c = doc.accessor(&[255, 0, 128, 51, 0, 0, 0, 0, 0, 0, 0, 0], 5121, 3, "VEC4");
    doc.json["accessors"][c]["normalized"] = json!(true);
    doc.primitive()["attributes"]["COLOR_0"] = json!(c);
    doc.primitive()["material"] = json!(0);
    doc.json["materials"] = json!([{
        "alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
        "extensions": { "KHR_materials_unlit": {} },
        "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 1.0, 0.75] },
    }]);
    let model = doc.load().unwrap();
    let m = &model.materials[0];
    assert_eq!(m.alpha_mode, AlphaMode::Mask { cutoff: 0.3 });
    assert!(m.double_sided && m.unlit);
    assert_eq!(m.base_color, [0.5, 0.25, 1.0, 0.75]);
    assert_eq!(model.meshes[0].colors[0], [1.0, 0.0, 128.0 / 255.0, 0.2]);
    assert_eq!(m.translucency, 1.0);
}

#[test]
fn diffuse_transmission_becomes_translucency() {
    for (own, want) in [
        (json!({}), Some(0.0)),
        (json!({ "diffuseTransmissionFactor": 0.2 }), Some(0.25)),
        (json!({ "diffuseTransmissionFactor": 0.9 }), Some(1.0)),
        (json!({ "diffuseTransmissionFactor": 1.5 }), None),
        (json!({ "diffuseTransmissionFactor": "much" }), None),
    ] {
        let mut doc = Doc::triangle();
        doc.primitive()["material"] = json!(0);
        let extensions = json!({ "KHR_materials_diffuse_transmission": own });
        doc.json["materials"] = json!([{ "extensions": extensions }]);
        match want {
            Some(want) => assert_eq!(doc.load().unwrap().materials[0].translucency, want),
            None => _ = doc.refused(&["material 0", "diffuseTransmissionFactor", "within 0 and 1"]),
        }
    }
}

#[test]
fn quantised_attributes_are_scaled_back() {
    let mut doc = Doc::new();
    let shorts = |v: &[i16]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let p = doc.accessor(&shorts(&[0, 0, 0, 0, 32767, 0, 0, 0, 0, -32767, 0, 0]), 5122, 3, "VEC3");
    doc.json["accessors"][p]["normalized"] = json!(true);
    let view = doc.json["accessors"][p]["bufferView"].as_u64().unwrap() as usize;
    doc.json["bufferViews"][view]["byteStride"] = json!(8);
    doc.primitive()["attributes"]["POSITION"] = json!(p);
    doc.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    doc.json["nodes"][0]["scale"] = json!([10, 10, 10]);
    let got = positions(doc.load().unwrap());
    assert_eq!(got, [Vec3::ZERO, Vec3::X * 10.0, Vec3::Y * -10.0]);
}

/// Adds a material with the texture `image` bytes; returns the texture info.
fn textured(doc: &mut Doc, image: &[u8], mime: &str) {
    let view = doc.view(image);
    doc.json["images"] = json!([{ "bufferView": view, "mimeType": mime }]);
    doc.json["textures"] = json!([{ "source": 0 }]);
    doc.json["materials"] =
        json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    let uv = doc.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC2");
    doc.primitive()["attributes"]["TEXCOORD_0"] = json!(uv);
    doc.primitive()["material"] = json!(0);
}

fn encoded(format: image::ImageFormat) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let image = image::RgbImage::from_pixel(8, 4, image::Rgb([200, 100, 50]));
    image.write_to(&mut out, format).unwrap();
    out.into_inner()
}

#[test]
fn png_jpeg_and_webp_images() {
    use image::ImageFormat::{Jpeg, Png, WebP};
    for (format, mime) in [(Png, "image/png"), (Jpeg, "image/jpeg"), (WebP, "image/webp")] {
        let mut doc = Doc::triangle();
        textured(&mut doc, &encoded(format), mime);
        if format == WebP {
            doc.json["textures"] =
                json!([{ "extensions": { "EXT_texture_webp": { "source": 0 } } }]);
            doc.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
        }
        let model = doc.load().unwrap();
        let t = &model.textures[0];
        assert_eq!((t.width, t.height), (8, 4));
        let off =
            t.texels[9].iter().zip([200, 100, 50, 255]).map(|(&a, b)| i32::from(a).abs_diff(b));
        assert!(off.max().unwrap() <= 3, "{format:?} {:?}", t.texels[9]);
    }
}

#[test]
fn sixteen_bit_png_is_rounded_to_eight() {
    let mut out = std::io::Cursor::new(Vec::new());
    let image = image::ImageBuffer::<image::Rgba<u16>, _>::from_pixel(
        2,
        2,
        image::Rgba([65535, 257 * 77, 0, 32896]),
    );
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    let mut doc = Doc::triangle();
    textured(&mut doc, &out.into_inner(), "image/png");
    assert_eq!(doc.load().unwrap().textures[0].texels[3], [255, 77, 0, 128]);
}

#[test]
fn texture_transforms_samplers_and_second_uv_sets() {
    let mut doc = Doc::triangle();
    textured(&mut doc, &encoded(image::ImageFormat::Png), "image/png");
    doc.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }]);
    doc.json["textures"][0]["sampler"] = json!(0);
    let uv1 = doc.floats(&[0.0, 0.0, 0.5, 0.0, 0.0, 0.25], "VEC2");
    doc.primitive()["attributes"]["TEXCOORD_1"] = json!(uv1);
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = json!({
        "KHR_texture_transform": {
            "offset": [0.0, 1.0], "rotation": std::f32::consts::FRAC_PI_2, "scale": [0.5, 0.5], "texCoord": 1,
        },
    });
    let model = doc.load().unwrap();
    assert_eq!(model.textures[0].wrap, [Wrap::Clamp, Wrap::Mirror]);
    // The extension's own example: rotated a quarter turn about the origin, from the bottom left.
    let want = [Vec2::new(0.0, 1.0), Vec2::new(0.0, 0.75), Vec2::new(0.125, 1.0)];
    for (got, want) in model.meshes[0].uvs.iter().zip(want) {
        assert!((*got - want).length() < 1e-6, "{got} {want}");
    }
}

#[test]
fn normal_textures_are_read_where_they_lie_as_the_colour() {
    let transform = json!({ "KHR_texture_transform": { "scale": [1.0, 0.1] } });
    let other = json!({ "KHR_texture_transform": { "scale": [1.0, 0.2] } });
    for (own, kept) in [(transform.clone(), true), (other, false)] {
        let mut doc = Doc::triangle();
        textured(&mut doc, &encoded(image::ImageFormat::Png), "image/png");
        doc.json["textures"] = json!([{ "source": 0 }, { "source": 0 }]);
        let m = &mut doc.json["materials"][0];
        m["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = transform.clone();
        m["normalTexture"] = json!({ "index": 1, "scale": 0.5, "extensions": own });
        let read = doc.read().unwrap();
        let relief = read.model.materials[0].relief;
        assert_eq!(relief, kept.then_some(Relief { texture: 0, scale: 0.5 }));
        assert_eq!(read.warnings.len(), usize::from(!kept), "{:?}", read.warnings);
    }
    // Alone it says how it lies; what cannot be read is left out, and told.
    let alone = || {
        let mut doc = Doc::triangle();
        textured(&mut doc, &encoded(image::ImageFormat::Png), "image/png");
        doc.json["materials"] =
            json!([{ "normalTexture": { "index": 0, "extensions": transform } }]);
        doc
    };
    let model = alone().load().unwrap();
    assert_eq!(model.materials[0].relief, Some(Relief { texture: 0, scale: 1.0 }));
    assert!((model.meshes[0].uvs[2].y - 0.1).abs() < 1e-7);
    let mut doc = alone();
    doc.json["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    let read = doc.read().unwrap();
    assert_eq!(read.model.materials[0].relief, None);
    assert!(read.warnings[0].contains("KHR_texture_basisu"), "{:?}", read.warnings);
    let mut doc = alone();
    doc.json["materials"][0]["normalTexture"]["index"] = json!(7);
    doc.refused(&["material 0", "texture 7 of 1"]);
}

#[test]
fn gpu_instances_stay_one_mesh() {
    let mut doc = Doc::triangle();
    let t = doc.floats(&[1., 0., 0., 0., 2., 0.], "VEC3");
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let r = doc.floats(&[0., 0., 0., 1., 0., 0., half, half], "VEC4");
    doc.json["nodes"][0]["translation"] = json!([0, 0, 10]);
    doc.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": t, "ROTATION": r } } });
    doc.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let model = doc.load().unwrap();
    assert_eq!((model.meshes.len(), model.instances.len(), model.triangle_count()), (1, 2, 2));
    let soup = model.flatten(10).unwrap();
    assert_eq!(soup.origin.to_array(), [1.0, 0.0, 10.0]);
    assert!(
        (soup.positions[4] - Vec3::new(-1.0, 3.0, 0.0)).length() < 1e-6,
        "{}",
        soup.positions[4]
    );
}

#[test]
fn meshopt_compressed_views() {
    let mut doc = Doc::new();
    let vertices: Vec<[f32; 3]> = (0..60).map(|i| [i as f32, (i % 7) as f32, 0.5]).collect();
    let order: Vec<u32> = (0..58).flat_map(|i| [i, i + 1, i + 2]).collect();
    let packed = [
        meshopt::encode_vertex_buffer(&vertices).unwrap(),
        meshopt::encode_index_buffer(&order, 60).unwrap(),
    ];
    let mut views = vec![];
    for (bytes, (mode, stride, count)) in
        packed.iter().zip([("ATTRIBUTES", 12, 60), ("TRIANGLES", 4, order.len())])
    {
        let view = doc.view(bytes);
        let inner = doc.json["bufferViews"][view].clone();
        doc.json["bufferViews"][view]["extensions"] = json!({ "EXT_meshopt_compression": {
            "buffer": 0, "byteOffset": inner["byteOffset"], "byteLength": inner["byteLength"],
            "byteStride": stride, "count": count, "mode": mode,
        }});
        views.push(view);
    }
    let p = doc.push(
        "accessors",
        json!({ "bufferView": views[0], "componentType": 5126, "count": 60, "type": "VEC3" }),
    );
    let i = doc.push("accessors", json!({ "bufferView": views[1], "componentType": 5125, "count": order.len(), "type": "SCALAR" }));
    *doc.primitive() = json!({ "attributes": { "POSITION": p }, "indices": i });
    doc.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    let mesh = &doc.load().unwrap().meshes[0];
    assert_eq!(mesh.positions[59].to_array(), vertices[59]);
    // The codec may turn a triangle, not change it.
    let sorted = |t: &[u32]| {
        let mut t = t.to_vec();
        t.sort_unstable();
        t
    };
    for (got, want) in mesh.triangles.iter().zip(order.chunks(3)) {
        assert_eq!(sorted(got), sorted(want));
    }
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut doc = Doc::triangle();
    let at = doc.view(&[1, 0]);
    let to = doc.view(&[9.0f32, 8.0, 7.0].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
    doc.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": at, "componentType": 5123 },
        "values": { "bufferView": to },
    });
    assert_eq!(doc.load().unwrap().meshes[0].positions[1], Vec3::new(9.0, 8.0, 7.0));
}

#[test]
fn what_is_not_supported_is_named() {
    let unsupported = |e: ImportError| assert!(matches!(e, ImportError::Unsupported { .. }), "{e}");
    let mut doc = Doc::triangle();
    doc.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    unsupported(doc.refused(&["KHR_draco_mesh_compression"]));
    // Used, not required, but the accessors are empty.
    let mut doc = Doc::triangle();
    doc.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    doc.primitive()["extensions"] = json!({ "KHR_draco_mesh_compression": { "bufferView": 0 } });
    unsupported(doc.refused(&["mesh 0 primitive 0", "KHR_draco_mesh_compression"]));
    let mut doc = Doc::triangle();
    textured(&mut doc, b"\xabKTX 20\xbb\r\n\x1a\n", "image/ktx2");
    doc.json["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    unsupported(doc.refused(&["texture 0", "KHR_texture_basisu"]));
    let mut doc = Doc::triangle();
    textured(&mut doc, b"BM not an image we read", "image/bmp");
    unsupported(doc.refused(&["image 0", "not PNG, JPEG or WebP"]));
}

#[test]
fn broken_references_name_element_value_and_limit() {
    let mut doc = Doc::triangle();
    let a = doc.accessor(&[0, 1, 9], 5121, 3, "SCALAR");
    doc.primitive()["indices"] = json!(a);
    doc.refused(&["mesh 0 primitive 0", "index 2 is 9, of 3 vertices"]);
    let mut doc = Doc::triangle();
    doc.json["accessors"][0]["count"] = json!(1000);
    doc.refused(&["accessor 0", "1000 elements", "36 bytes"]);
    let mut doc = Doc::triangle();
    doc.primitive()["attributes"]["POSITION"] = json!(7);
    doc.refused(&["accessor 7 of 1"]);
    let mut doc = Doc::triangle();
    doc.json["nodes"][0]["children"] = json!([0]);
    doc.refused(&["node 0", "its own ancestor"]);
    let mut doc = Doc::triangle();
    doc.json["nodes"] = json!([{ "children": [1, 1] }, { "mesh": 0 }]);
    doc.refused(&["node 1", "two parents"]);
    let mut doc = Doc::triangle();
    doc.primitive()["material"] = json!(3);
    doc.refused(&["material 3 of 0"]);
    let mut doc = Doc::triangle();
    textured(&mut doc, &encoded(image::ImageFormat::Png), "image/png");
    doc.json["images"] = json!([{ "uri": "gone.png" }]);
    doc.refused(&["image 0 (gone.png)", "gone.png"]);
}

/// A document that uses everything, for mutation.
fn rich() -> String {
    let mut doc = Doc::triangle();
    textured(&mut doc, &encoded(image::ImageFormat::Png), "image/png");
    let a = doc.accessor(&[0, 1, 2], 5121, 3, "SCALAR");
    doc.primitive()["indices"] = json!(a);
    let data = base64::engine::general_purpose::STANDARD.encode(&doc.bytes);
    doc.json["buffers"][0] = json!({
        "byteLength": doc.bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}"),
    });
    doc.json.to_string()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    /// Numbers replaced anywhere in the JSON give a model or an error, never a panic.
    #[test]
    fn mutated_numbers_never_panic(at in 0usize..60, value in prop::sample::select(vec![
        "0", "1", "2", "-1", "255", "65535", "4294967295", "4294967296", "18446744073709551615", "1e300", "0.5",
    ])) {
        let text = rich();
        // Runs of digits before the buffer's data.
        let bytes = text.as_bytes();
        let mut digits = vec![];
        let mut i = 0;
        while i < text.find("base64,").unwrap() {
            let start = i;
            while bytes[i].is_ascii_digit() {
                i += 1;
            }
            if i > start {
                digits.push((start, i));
            }
            i += 1;
        }
        let (start, end) = digits[at % digits.len()];
        let changed = format!("{}{}{}", &text[..start], value, &text[end..]);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.gltf");
        std::fs::write(&path, changed).unwrap();
        let _ = load(&path, &Limits::default()).map(|i| i.model.flatten(1000));
    }
}
