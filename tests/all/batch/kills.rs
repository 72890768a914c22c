//! Killed at any moment, a batch leaves nothing half done, and goes on where it stopped.

use super::{Farm, POINTS, files, names};
use crate::support::{arg, forest_bake, succeed};
use forest_tests::figures;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// Of trees with pictures: packs and exports.
const MORE: &str = "[bake]\npreset = \"draft\"\nexports = [\"png\"]\nviews = { texels = 64, views = 16 }\n\
    [[asset]]\nfiles = [\"trees/*.obj\"]\n";

/// Folders of work and files that are not whole, in a farm.
fn left(farm: &Farm) -> Vec<String> {
    let mut out = Vec::new();
    files(farm.folder.path(), &mut |path| {
        let text = path.strip_prefix(farm.folder.path()).unwrap().display().to_string();
        if text.contains("work-") || text.contains(".fpack-") || text.contains("making") {
            out.push(text);
        }
    });
    out
}

/// Makes all that was left a minute older: what is new might be that of others, and is left alone.
fn age_left(folder: &Path) {
    let past = SystemTime::now() - Duration::from_secs(60);
    let age = |path: &Path| File::open(path).unwrap().set_modified(past).unwrap();
    files(folder, &mut |path| {
        if path.file_name().unwrap().to_string_lossy().starts_with(".fpack-") {
            age(path);
        }
        let is_work = |p: &&Path| {
            let name = p.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(".forest-bake-work-") || name.starts_with("entry-")
        };
        path.ancestors().filter(is_work).for_each(age);
    });
}

#[test]
fn killed_at_random_points_it_loses_nothing_and_ends_with_the_same_bytes() {
    for (text, cache) in [(MORE, false), (POINTS, true)] {
        let count = 24;
        let reference = Farm::new(&names(count), text);
        reference.summary(0, &[]);
        let want = reference.made();
        let farm = Farm::new(&names(count), text);
        let cache_folder = arg(&farm.path("cache"));
        let options: &[&str] = if cache { &["--cache", &cache_folder] } else { &[] };
        let mut rng = Pcg32::seed_from_u64(3);
        let program = forest_bake().get_program().to_owned();
        let mut kills = 0;
        let runs = 12 * figures::effort() as u32;
        for run in 0..runs {
            // What is finished would leave nothing to kill.
            if run > 0 && run % 12 == 0 {
                farm.forget();
            }
            let mut child = Command::new(&program)
                .args(["batch", &arg(&farm.manifest()), "-q"])
                .args(options)
                .stdin(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            // Every third run gets somewhere first, however slow the machine is.
            let (start, before) = (Instant::now(), farm.made().len());
            while run % 3 == 2
                && farm.made().len() == before
                && start.elapsed() < Duration::from_secs(60)
                && child.try_wait().unwrap().is_none()
            {
                std::thread::sleep(Duration::from_millis(20));
            }
            std::thread::sleep(Duration::from_millis(rng.random_range(20..700)));
            kills += u32::from(child.try_wait().unwrap().is_none());
            // SIGKILL: nobody can see to anything any more.
            child.kill().unwrap();
            child.wait().unwrap();
            // What has its name is whole, and what it should be.
            for (name, bytes) in farm.made() {
                assert_eq!(want.get(&name), Some(&bytes), "{name}");
            }
        }
        assert!(kills >= runs / 2, "{kills} of {runs} runs were still at work");
        let name = if cache { "kills-cache" } else { "kills" };
        figures::note(name, f64::from(kills));
        let summary = farm.summary(0, options);
        let current = summary["assets"].as_array().unwrap().iter();
        let current = current.filter(|a| a["status"] == "current").count();
        assert!(current > 0, "it went on where it stopped");
        // Bakes of the dead end with them, and what they left is removed by the next that works there.
        std::thread::sleep(Duration::from_millis(300));
        age_left(farm.folder.path());
        farm.summary(0, &[options, &["--force"]].concat());
        assert_eq!(farm.made(), want);
        assert_eq!(left(&farm), Vec::<String>::new());
    }
}

/// A bake whose files may not grow (a full disk, or a quota) fails, and leaves what was there.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_what_was_there() {
    let farm = Farm::new(&names(2), POINTS);
    farm.summary(0, &[]);
    let before = farm.made();
    let program = forest_bake().get_program().to_string_lossy().into_owned();
    // Blocks of 512 bytes: no pack is so small.
    let line =
        format!("ulimit -f 8; exec '{program}' batch '{}' --force -q", arg(&farm.manifest()));
    let status = Command::new("sh").args(["-c", &line]).stderr(Stdio::null()).status().unwrap();
    assert!(!status.success());
    assert_eq!(farm.made(), before);
    farm.summary(0, &["--force"]);
    assert_eq!(farm.made(), before);
    assert_eq!(left(&farm), Vec::<String>::new());
}

/// The temporary files of single commands that were killed go with the next pack that is written there.
#[cfg(unix)]
#[test]
fn what_killed_commands_left_is_removed() {
    let dir = tempfile::tempdir().unwrap();
    let tree = arg(&crate::support::repo("sample-data/conifer.glb"));
    let pack = arg(&dir.path().join("t.fpack"));
    let program = forest_bake().get_program().to_owned();
    let hidden = |folder: &Path| {
        let mut count = 0;
        files(folder, &mut |p| {
            count += usize::from(p.file_name().unwrap().to_string_lossy().starts_with('.'));
        });
        count
    };
    let mut seen = 0;
    for wait in 1..40 {
        let mut child = Command::new(&program)
            .args(["points", &tree, "-o", &pack, "-q", "--force"])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(20 * wait));
        child.kill().unwrap();
        child.wait().unwrap();
        seen = seen.max(hidden(dir.path()));
        age_left(dir.path());
        if seen > 0 && wait > 10 {
            break;
        }
    }
    assert!(seen > 0, "no run was killed while it wrote");
    succeed(&["points", &tree, "-o", &pack, "-q", "--force"]);
    assert_eq!(hidden(dir.path()), 0);
}
