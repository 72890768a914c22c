use super::*;
use crate::{Limits, load as load_file};
use std::path::Path;

fn write(dir: &Path, name: &str, text: &str) {
    std::fs::write(dir.join(name), text).unwrap();
}

fn png(dir: &Path, name: &str, size: u32, texel: impl Fn(u32, u32) -> [u8; 4]) {
    image::RgbaImage::from_fn(size, size, |x, y| image::Rgba(texel(x, y)))
        .save_with_format(dir.join(name), image::ImageFormat::Png)
        .unwrap();
}

fn import(dir: &Path) -> Model {
    load_file(&dir.join("t.obj"), &Limits::default()).unwrap().model
}

fn area(model: &Model) -> f32 {
    let triangle = |m: &Mesh, t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| m.positions[v as usize]);
        (b - a).cross(c - a).length() / 2.0
    };
    model.meshes.iter().flat_map(|m| m.triangles.iter().map(move |t| triangle(m, t))).sum()
}

#[test]
fn quads_concave_polygons_and_negative_indices() {
    let dir = tempfile::tempdir().unwrap();
    // A unit square, an L of area 3 (a fan from its first corner would fold over), a triangle
    // counted from the end.
    write(
        dir.path(),
        "t.obj",
        "\
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n\
v 1 1 5\nv 1 2 5\nv 0 2 5\nv 0 0 5\nv 2 0 5\nv 2 1 5\nf 5 6 7 8 9 10\n\
v 0 0 9\nv 1 0 9\nv 0 1 9\nf -3 -2 -1\n",
    );
    let model = import(dir.path());
    assert_eq!(model.triangle_count(), 2 + 4 + 1);
    assert!((area(&model) - (1.0 + 3.0 + 0.5)).abs() < 1e-5, "{}", area(&model));
}

#[test]
fn loose_edges_are_left_out() {
    // Blender writes the edges of no face as lines; they have no texture coordinates.
    let dir = tempfile::tempdir().unwrap();
    write(
        dir.path(),
        "t.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nvt 0 0\nl 1 4\np 2\nf 1/1 2/1 3/1\n",
    );
    let model = import(dir.path());
    assert_eq!((model.triangle_count(), model.meshes[0].uvs.len()), (1, 3));
}

/// Lines of a small OBJ and its MTL with words replaced: a model or an error, never a panic.
#[test]
fn mutated_words_never_panic() {
    let obj = "mtllib t.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0 0.5 0.5 0.5\nvn 0 0 1\nvt 0 0\nusemtl m\nf 1/1/1 2/1/1 3/1/1\ns 1\ng x\n";
    let mtl = "newmtl m\nKd 1 1 1\nNs 2\nd 1\nTr 0\nillum 2\nNi 1\n";
    let words = [
        "",
        "0",
        "-1",
        "1",
        "1/",
        "//",
        "1//1",
        "/1",
        "-9",
        "4",
        "1e99",
        "nan",
        "f",
        "x",
        "9223372036854775807",
    ];
    let dir = tempfile::tempdir().unwrap();
    for (name, other, text) in [("t.obj", "t.mtl", obj), ("t.mtl", "t.obj", mtl)] {
        write(dir.path(), other, if other == "t.obj" { obj } else { mtl });
        let places: Vec<(usize, &str)> = text
            .split_inclusive([' ', '\n'])
            .scan(0, |at, w| {
                *at += w.len();
                Some((*at - w.len(), w))
            })
            .collect();
        for (at, old) in places {
            for word in words {
                let end = at + old.trim_end().len();
                write(dir.path(), name, &format!("{}{word}{}", &text[..at], &text[end..]));
                let _ = load_file(&dir.path().join("t.obj"), &Limits::default())
                    .map(|i| i.model.flatten(99));
            }
        }
    }
}

#[test]
fn alpha_comes_from_map_d_from_map_kd_or_from_tr() {
    let dir = tempfile::tempdir().unwrap();
    png(dir.path(), "leaf one.png", 2, |x, _| [10, 200, 30, if x == 0 { 0 } else { 255 }]);
    png(dir.path(), "mask.png", 4, |x, _| if x < 2 { [0, 0, 0, 255] } else { [255; 4] });
    write(
        dir.path(),
        "t.mtl",
        "\
newmtl own\nKd 0.1 0.1 0.1\nmap_Kd leaf one.png\n\
newmtl masked\nmap_Kd leaf one.png\nmap_d -clamp on mask.png\n\
newmtl glass\nKd 0.5 0.25 0.125\nTr 0.75\n\
newmtl solid\nKd 1 0 0\nd 1.0\n",
    );
    let mut obj = String::from("mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n");
    for m in ["own", "masked", "glass", "solid"] {
        obj.push_str(&format!("usemtl {m}\nf 1/1 2/2 3/3\n"));
    }
    write(dir.path(), "t.obj", &obj);
    let model = import(dir.path());
    let [own, masked, glass, solid] = &model.materials[..] else { panic!() };
    assert_eq!(own.alpha_mode, AlphaMode::Blend);
    assert_eq!(own.base_color, [1.0; 4]); // the map replaces Kd
    let alphas = |m: &Material| {
        model.textures[m.texture.unwrap() as usize].texels.iter().map(|t| t[3]).collect::<Vec<_>>()
    };
    assert_eq!(alphas(own), [0, 255, 0, 255]);
    let mask = alphas(masked);
    assert!(mask[0] < 40 && mask[1] > 215, "{mask:?}"); // brightness, resized to 2×2
    assert_eq!((glass.base_color, glass.alpha_mode), ([0.5, 0.25, 0.125, 0.25], AlphaMode::Blend));
    assert_eq!(solid.alpha_mode, AlphaMode::Opaque);
    // v counts from the bottom.
    assert_eq!(model.meshes[0].uvs[0], Vec2::new(0.0, 1.0));
}

#[test]
fn bumps_are_normals_not_heights() {
    let dir = tempfile::tempdir().unwrap();
    png(dir.path(), "normals.png", 2, |x, _| [100 + 56 * x as u8, 128, 240, 255]);
    png(dir.path(), "heights.png", 2, |x, _| [[90; 4], [200; 4]][x as usize]);
    write(
        dir.path(),
        "t.mtl",
        "newmtl a\nmap_Kd heights.png\nmap_Bump -bm 0.5 normals.png\n\
         newmtl b\nbump heights.png\nnewmtl c\nnorm heights.png\n\
         newmtl d\nmap_Kd -s 2 2 heights.png\nnorm normals.png\nnewmtl e\nnorm gone.png\n",
    );
    let mut obj = String::from("mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n");
    for m in ["a", "b", "c", "d", "e"] {
        obj.push_str(&format!("usemtl {m}\nf 1/1 2/2 3/3\n"));
    }
    write(dir.path(), "t.obj", &obj);
    let read = load_file(&dir.path().join("t.obj"), &Limits::default()).unwrap();
    let [a, b, c, d, e] = &read.model.materials[..] else { panic!() };
    let relief = a.relief.unwrap();
    assert_eq!(
        (relief.scale, read.model.textures[relief.texture as usize].texels[1][0]),
        (0.5, 156)
    );
    assert!(
        b.relief.is_none() && c.relief.is_some(),
        "heights, unless they are said to be normals"
    );
    assert!(d.relief.is_none() && e.relief.is_none());
    let told = read.warnings.join("\n");
    assert!(told.contains("material d") && told.contains("gone.png"), "{told}");
}

#[test]
fn map_options_are_not_part_of_the_name() {
    let parse = MapOptions::parse;
    let (o, name) = parse("-s 2 3 1 -o 0.5 0.25 -bm 0.2 -clamp on leaf card.png");
    assert_eq!(
        (o.scale, o.offset, o.wrap, name),
        ([2.0, 3.0], [0.5, 0.25], Wrap::Clamp, "leaf card.png")
    );
    assert_eq!(parse("plain.png").1, "plain.png");
    assert_eq!(parse("-s 2").1, "2"); // nonsense names the odd word, and reading it fails by name
}

#[test]
fn missing_files_are_named() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "t.obj", "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let e = load_file(&dir.path().join("t.obj"), &Limits::default()).unwrap_err().to_string();
    assert!(e.contains("gone.mtl"), "{e}");
    write(dir.path(), "gone.mtl", "newmtl a\nmap_Kd nowhere.png\n");
    let e = load_file(&dir.path().join("t.obj"), &Limits::default()).unwrap_err().to_string();
    assert!(e.contains("material a") && e.contains("nowhere.png"), "{e}");
    write(dir.path(), "gone.mtl", "newmtl a\nmap_Kd ../up.png\n");
    let e = load_file(&dir.path().join("t.obj"), &Limits::default()).unwrap_err().to_string();
    assert!(e.contains("../up.png") && e.contains("outside"), "{e}");
}
