//! Running the shipped program.

use assert_cmd::Command;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// `forest-bake` of this build, built if need be: a stale program would be tested otherwise.
pub(crate) fn forest_bake() -> Command {
    static PROGRAM: LazyLock<PathBuf> = LazyLock::new(|| {
        let exe = std::env::current_exe().expect("the path of this test");
        // target/<profile>/deps/all-…
        let folder = exe.ancestors().nth(2).expect("a target folder");
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
        let mut build = std::process::Command::new(cargo);
        build
            .args(["build", "--quiet", "--workspace", "--bins", "--examples"])
            .current_dir(repo("."));
        if folder.ends_with("release") {
            build.arg("--release");
        }
        assert!(build.status().expect("cargo runs").success(), "forest-bake does not build");
        folder.join("forest-bake")
    });
    Command::new(&*PROGRAM)
}

/// Runs it and returns (exit code, stdout, stderr).
pub(crate) fn run(args: &[&str]) -> (i32, String, String) {
    let output = forest_bake().args(args).output().expect("the program starts");
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

/// Runs it, insists on success, and returns stdout.
pub(crate) fn succeed(args: &[&str]) -> String {
    let (code, out, err) = run(args);
    assert_eq!(code, 0, "{args:?}\n{err}");
    out
}

/// A file of this repository.
pub(crate) fn repo(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(relative)
}

/// A folder of ../shared beside the checkout, where it is; else says that something is skipped.
pub(crate) fn shared(folder: &str) -> Option<PathBuf> {
    let path = repo("../shared").join(folder);
    if path.exists() {
        return Some(path);
    }
    // Past the harness, which keeps to itself what a passing test prints.
    let _ = writeln!(std::io::stderr(), "skipped: {} is not there", path.display());
    None
}

/// A path as an argument.
pub(crate) fn arg(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// `inspect --json` of a pack.
pub(crate) fn inspect(pack: &Path) -> serde_json::Value {
    serde_json::from_str(&succeed(&["inspect", "--json", &arg(pack)])).expect("JSON")
}
