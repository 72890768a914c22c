//! Running the shipped program.

use assert_cmd::Command;
use std::path::{Path, PathBuf};

/// `forest-bake` of this build.
pub(crate) fn forest_bake() -> Command {
    let exe = std::env::current_exe().expect("the path of this test");
    // target/<profile>/deps/all-… → target/<profile>/forest-bake
    let program = exe.ancestors().nth(2).expect("a target folder").join("forest-bake");
    assert!(
        program.exists(),
        "{} is missing: run `make test`, or `cargo build -p forest-bake` first",
        program.display()
    );
    Command::new(program)
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

/// A path as an argument.
pub(crate) fn arg(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// `inspect --json` of a pack.
pub(crate) fn inspect(pack: &Path) -> serde_json::Value {
    serde_json::from_str(&succeed(&["inspect", "--json", &arg(pack)])).expect("JSON")
}
