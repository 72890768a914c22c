use forest_tests::{golden, use_pack};

fn committed() -> Vec<(&'static str, Vec<u8>)> {
    let read = |g: &golden::Golden| {
        let bytes = std::fs::read(g.path());
        (g.name, bytes.unwrap_or_else(|e| panic!("{}: {e} (make golden)", g.path().display())))
    };
    golden::all().iter().map(read).collect()
}

#[test]
fn committed_packs_are_read_and_baked_again_to_the_byte() {
    for (golden, (name, bytes)) in golden::all().iter().zip(committed()) {
        assert!(bytes.len() <= golden::MAX_BYTES, "{name}: {} bytes", bytes.len());
        assert!(use_pack(&bytes).unwrap() > 0, "{name}");
        assert!(golden.bake() == bytes, "{name} bakes to other bytes than are committed");
    }
}

#[test]
fn every_prefix_is_refused() {
    for (name, bytes) in committed() {
        for n in 0..bytes.len() {
            assert!(use_pack(&bytes[..n]).is_err(), "{name}: the first {n} bytes pass");
        }
    }
}

#[test]
fn every_flipped_byte_is_refused() {
    for (name, mut bytes) in committed() {
        for i in 0..bytes.len() {
            bytes[i] ^= 0x41;
            assert!(use_pack(&bytes).is_err(), "{name}: byte {i} may be anything");
            bytes[i] ^= 0x41;
        }
    }
}
