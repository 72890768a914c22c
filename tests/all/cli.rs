use crate::support::{arg, forest_bake, inspect, repo, run, succeed};
use std::fs;

#[test]
fn every_sample_bakes_verifies_and_says_what_it_holds() {
    let dir = tempfile::tempdir().unwrap();
    for (name, triangles) in
        [("conifer.glb", 20_000), ("broadleaf_young.gltf", 42_000), ("shrub.obj", 4_000)]
    {
        let pack = dir.path().join(name).with_extension("fpack");
        let source = arg(&repo("sample-data").join(name));
        let json = succeed(&["points", &source, "-o", &arg(&pack), "--json", "-q"]);
        let summary: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(summary["triangles"], triangles);
        assert!(succeed(&["verify", &arg(&pack)]).ends_with("ok\n"));
        let report = inspect(&pack);
        assert_eq!(report["points"]["counts"]["source_triangles"], triangles);
        assert_eq!(report["points"]["triangles"], triangles);
        assert_eq!(report["bytes"], fs::metadata(&pack).unwrap().len());
        assert_eq!(report["sources"][0]["name"], name);
        // Sizes and positions are those of the source: a conifer is about nine units tall.
        let height = report["points"]["max"][1].as_f64().unwrap()
            - report["points"]["min"][1].as_f64().unwrap();
        let want = match name {
            "conifer.glb" => 7.0..11.0,
            "shrub.obj" => 1.0..3.0,
            _ => 5.0..12.0,
        };
        assert!(want.contains(&height), "{name}: {height}");
        let text = succeed(&["inspect", &arg(&pack)]);
        assert!(text.contains("points.cells[0]") && text.contains("bytes per surfel"), "{text}");
    }
}

#[test]
fn exit_codes_are_the_documented_ones() {
    let dir = tempfile::tempdir().unwrap();
    let out = arg(&dir.path().join("o.fpack"));
    let write = |name: &str, text: &str| {
        let path = dir.path().join(name);
        fs::write(&path, text).unwrap();
        arg(&path)
    };
    let fails = |args: &[&str], code: i32, want: &[&str]| {
        let (got, _, err) = run(args);
        assert_eq!(got, code, "{args:?}\n{err}");
        assert!(want.iter().all(|w| err.contains(w)), "{err}");
        assert!(!dir.path().join("o.fpack").exists());
    };
    fails(&["points"], 1, &["Usage"]);
    fails(&["points", "a.glb", "-o", &out, "--grid", "4x4"], 2, &["a.glb"]);
    fails(&["points", &write("e.obj", ""), "-o", &out], 3, &["no triangle"]);
    let triangle = write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    fails(&["points", &triangle, "-o", &out, "--grid", "4x4"], 1, &["4x4"]);
    fails(&["points", &triangle, "-o", &out, "--surfel-size", "-1"], 1, &["--surfel-size"]);
    fails(
        &["points", &triangle, "-o", &out, "--max-triangles", "0"],
        3,
        &["1 triangles", "limit is 0"],
    );
    fails(&["points", &triangle, "-o", "/nonexistent/o.fpack"], 2, &["/nonexistent/o.fpack"]);
    fails(&["points", &write("x.fbx", "?"), "-o", &out], 5, &["\"fbx\""]);
    let draco =
        r#"{"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"]}"#;
    fails(
        &["points", &write("d.gltf", draco), "-o", &out],
        5,
        &["d.gltf", "KHR_draco_mesh_compression"],
    );
    fails(&["verify", &triangle], 3, &["t.obj", "not an fpack"]);
    fails(&["inspect", &arg(&dir.path().join("none.fpack"))], 2, &["none.fpack"]);
    let textured = write("m.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
    write("m.mtl", "newmtl a\nmap_Kd lost.png\n");
    fails(&["points", &textured, "-o", &out], 3, &["material a", "lost.png"]);
    let (code, help, _) = run(&["--help"]);
    assert!(code == 0 && help.contains("Exit codes"));
}

#[test]
fn nothing_is_left_beside_a_failed_or_finished_pack() {
    let dir = tempfile::tempdir().unwrap();
    let shrub = arg(&repo("sample-data/shrub.obj"));
    succeed(&["points", &shrub, "-o", &arg(&dir.path().join("a.fpack")), "-q"]);
    let names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["a.fpack"]);
}

#[test]
fn a_pack_of_another_source_is_not_overwritten_without_force() {
    let dir = tempfile::tempdir().unwrap();
    let pack = arg(&dir.path().join("a.fpack"));
    let shrub = arg(&repo("sample-data/shrub.obj"));
    let conifer = arg(&repo("sample-data/conifer.glb"));
    succeed(&["points", &shrub, "-o", &pack, "-q"]);
    let before = fs::read(&pack).unwrap();
    let (code, _, err) = run(&["points", &conifer, "-o", &pack, "-q"]);
    assert!(code == 1 && err.contains("another source") && err.contains("--force"), "{err}");
    assert_eq!(fs::read(&pack).unwrap(), before);
    // The same source again replaces its own sections and gives the same bytes.
    succeed(&["points", &shrub, "-o", &pack, "-q"]);
    assert_eq!(fs::read(&pack).unwrap(), before);
    succeed(&["points", &conifer, "-o", &pack, "-q", "--force"]);
    assert_ne!(fs::read(&pack).unwrap(), before);
    // What is no pack at all is not overwritten either.
    fs::write(&pack, "my only copy of a poem").unwrap();
    assert_eq!(run(&["points", &shrub, "-o", &pack, "-q"]).0, 1);
    assert_eq!(fs::read(&pack).unwrap(), b"my only copy of a poem");
}

#[test]
fn sections_of_other_representations_stay() {
    use forest_pack::{Codec, Pack, PackWriter, SectionId};
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.fpack");
    let shrub = arg(&repo("sample-data/shrub.obj"));
    succeed(&["points", &shrub, "-o", &arg(&path), "-q"]);
    let other = SectionId::new(900, 5);
    let pack = Pack::open(&path).unwrap();
    let mut writer = PackWriter::create(&path).unwrap();
    pack.sections().for_each(|(id, _)| writer.copy(&pack, id).unwrap());
    writer.add(other, Codec::Zstd, b"views, say").unwrap();
    writer.finish().unwrap();
    succeed(&["points", &shrub, "-o", &arg(&path), "-q", "--grid", "2x2x2"]);
    let pack = Pack::open(&path).unwrap();
    assert_eq!(&*pack.bytes(other, 100).unwrap(), b"views, say");
}

#[test]
fn draw_writes_pictures_that_show_the_tree() {
    let dir = tempfile::tempdir().unwrap();
    let pack = arg(&dir.path().join("a.fpack"));
    let png = dir.path().join("a.png");
    succeed(&["points", &arg(&repo("sample-data/shrub.obj")), "-o", &pack, "-q"]);
    succeed(&[
        "draw",
        &pack,
        "-o",
        &arg(&png),
        "--size",
        "64",
        "--finest",
        "1,8,64",
        "--alpha",
        "-q",
    ]);
    let picture = image::open(&png).unwrap().to_rgba8();
    assert_eq!(picture.dimensions(), (192, 64));
    let covered = |x0: u32| {
        let sum: u32 =
            (0..64 * 64).map(|i| u32::from(picture.get_pixel(x0 + i % 64, i / 64).0[3])).sum();
        f64::from(sum) / (255.0 * 64.0 * 64.0)
    };
    let [fine, middle, coarse] = [0, 64, 128].map(covered);
    assert!((0.05..0.6).contains(&fine), "{fine}");
    assert!(
        (middle / fine - 1.0).abs() < 0.1 && (coarse / fine - 1.0).abs() < 0.15,
        "{fine} {middle} {coarse}"
    );
    // Leaves are green, and most of what is seen of a shrub is leaves.
    let seen: Vec<[u8; 4]> = picture.pixels().map(|p| p.0).filter(|p| p[3] > 64).collect();
    let green = seen.iter().filter(|p| p[1] > p[0] && p[1] > p[2]).count();
    assert!(2 * green > seen.len(), "{green} of {}", seen.len());
    let (code, _, err) = run(&["draw", &pack, "-o", &arg(&png), "--view", "sideways"]);
    assert!(code == 1 && err.contains("sideways"));
    let jpg = dir.path().join("a.jpg");
    let (code, _, err) = run(&["draw", &pack, "-o", &arg(&jpg)]);
    assert!(code == 1 && err.contains(".png") && !jpg.exists());
}

#[test]
fn levels_show_what_each_rule_keeps() {
    let shrub = arg(&repo("sample-data/shrub.obj"));
    let json = succeed(&["levels", &shrub, "--surfel-size", "triangle", "--json"]);
    let tables: serde_json::Value = serde_json::from_str(&json).unwrap();
    let table = |name: &str| {
        let all = tables.as_array().unwrap();
        all.iter().find(|t| t["name"] == name).unwrap()["rows"].as_array().unwrap().clone()
    };
    for row in table("area") {
        assert!((row["area_kept"].as_f64().unwrap() - 1.0).abs() < 0.01, "{row}");
        assert_eq!((row["missing"].as_f64(), row["doubled"].as_f64()), (Some(0.0), Some(0.0)));
    }
    let paper = table("paper radius and order");
    assert!(paper.iter().any(|r| r["under_ancestor"].as_u64().unwrap() > 0));
}

/// A tree from standard input, a picture to standard output.
#[test]
fn trees_and_pictures_go_through_pipes() {
    let dir = tempfile::tempdir().unwrap();
    let [piped, filed, picture] = ["a.fpack", "b.fpack", "b.png"].map(|n| arg(&dir.path().join(n)));
    for tree in ["conifer.glb", "shrub.obj"] {
        let file = repo("sample-data").join(tree);
        let bytes = fs::read(&file).unwrap();
        let bake = |from: &str, to: &str| {
            forest_bake()
                .args(["points", from, "-o", to, "--force", "-q", "--surfel-size", "0.2"])
                .write_stdin(bytes.clone())
                .output()
                .unwrap()
        };
        let output = bake("-", &piped);
        let error = String::from_utf8_lossy(&output.stderr);
        if tree == "shrub.obj" {
            // What is beside a file is not beside a pipe.
            assert_eq!(output.status.code(), Some(3), "{error}");
            assert!(error.contains("-: mtllib: cannot read shrub.mtl"), "{error}");
            continue;
        }
        assert!(output.status.success(), "{error}");
        assert!(bake(&arg(&file), &filed).status.success());
        let draw = |pack: &str, to: &str| {
            forest_bake().args(["draw", pack, "-o", to, "--size", "64", "-q"]).output().unwrap()
        };
        assert!(draw(&filed, &picture).status.success());
        let drawn = draw(&piped, "-");
        assert!(drawn.status.success() && drawn.stdout == fs::read(&picture).unwrap());
    }
}
