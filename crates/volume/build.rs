//! The block encoder brings objects of C++ without saying that they want its runtime.

fn main() {
    let target = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    match target.as_str() {
        "linux" => println!("cargo::rustc-link-lib=stdc++"),
        "macos" => println!("cargo::rustc-link-lib=c++"),
        _ => {}
    }
    println!("cargo::rerun-if-changed=build.rs");
}
