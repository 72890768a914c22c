//! Damaged files through the shipped program: each ends in a result or in an error that names a file.

use crate::support::{arg, forest_bake, repo};
use forest_tests::figures;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A file that is damaged, and what is done then.
struct Victim {
    file: &'static str,
    /// The command, where {} is the folder.
    command: &'static str,
}

const CONIFER: &str = "points {}/conifer.glb -o {}/out.fpack --surfel-size 0.3";
const BROADLEAF: &str = "points {}/broadleaf_young.gltf -o {}/out.fpack --surfel-size 0.3";
const SHRUB: &str = "points {}/shrub.obj -o {}/out.fpack --surfel-size 0.3";

const VICTIMS: [Victim; 10] = [
    Victim { file: "conifer.glb", command: CONIFER },
    Victim { file: "broadleaf_young.gltf", command: BROADLEAF },
    Victim { file: "broadleaf_young.bin", command: BROADLEAF },
    Victim { file: "broadleaf_young_leaves.png", command: BROADLEAF },
    Victim { file: "shrub.obj", command: SHRUB },
    Victim { file: "shrub.mtl", command: SHRUB },
    Victim { file: "shrub_leaves.png", command: SHRUB },
    Victim { file: "tree.fpack", command: "draw {}/tree.fpack -o {}/out.png --size 24" },
    Victim { file: "tree.fpack", command: "export {}/tree.fpack -o {}/out --format glb" },
    Victim { file: "measured.fpack", command: "inspect {}/measured.fpack" },
];

/// One of the ways in which disks, networks and people damage files.
fn damage(bytes: &mut Vec<u8>, rng: &mut Pcg32) {
    let length = bytes.len();
    let from = rng.random_range(0..length);
    let to = (from + rng.random_range(1..5000)).min(length);
    match rng.random_range(0..6) {
        0 => bytes.truncate(from),
        1 => bytes[from..to].fill(0),
        2 => bytes[from..to].fill(0xff),
        3 => drop(bytes.drain(from..to)),
        4 => bytes.extend_from_within(from..to),
        _ => {
            for _ in 0..rng.random_range(1..20) {
                let at = rng.random_range(0..length);
                bytes[at] = rng.random();
            }
        }
    }
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let copy = |from: PathBuf| {
        std::fs::copy(&from, folder.path().join(from.file_name().unwrap())).unwrap();
    };
    for name in VICTIMS.iter().map(|v| v.file).chain(["broadleaf_young_bark.png", "shrub_bark.png"])
    {
        let sample = repo("sample-data").join(name);
        if sample.exists() { copy(sample) } else { copy(repo("tests/golden").join(name)) }
    }
    folder
}

#[test]
fn damaged_files_end_in_results_or_errors() {
    let mut rng = Pcg32::seed_from_u64(11);
    let (mut refused, mut taken) = (0, 0);
    for i in 0..40 * figures::effort() {
        let folder = folder();
        let victim = &VICTIMS[i % VICTIMS.len()];
        let path = folder.path().join(victim.file);
        let mut bytes = std::fs::read(&path).unwrap();
        damage(&mut bytes, &mut rng);
        std::fs::write(&path, &bytes).unwrap();
        let before = names(folder.path());
        let root = arg(folder.path());
        let args: Vec<String> =
            victim.command.split(' ').map(|word| word.replace("{}", &root)).collect();
        let output = forest_bake().args(&args).timeout(Duration::from_secs(100)).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        match output.status.code() {
            Some(0) => taken += 1,
            Some(2..=5) => {
                refused += 1;
                assert!(error.contains(&root), "{args:?}: names no file: {error}");
                assert_eq!(names(folder.path()), before, "{args:?}");
            }
            other => panic!("{args:?} of a damaged {}: {other:?}\n{error}", victim.file),
        }
    }
    assert!(refused > 10 && taken > 0, "{refused} refused, {taken} taken");
    figures::note("damaged-refused", f64::from(refused));
    figures::note("damaged-taken", f64::from(taken));
}

fn names(folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    names.sort();
    names
}
