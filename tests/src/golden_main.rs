//! Writes the golden packs: run by `make golden`, after a change of the format that is meant.

fn main() -> std::io::Result<()> {
    for golden in forest_tests::golden::all() {
        let bytes = golden.bake();
        assert!(bytes.len() <= forest_tests::golden::MAX_BYTES, "{}: {}", golden.name, bytes.len());
        std::fs::write(golden.path(), &bytes)?;
        println!("{}: {} bytes", golden.path().display(), bytes.len());
    }
    Ok(())
}
