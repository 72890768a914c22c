//! What the programs that write reports share.

use anyhow::{Result, bail};
use forest_import::{Block, Limits};
use forest_soup::TriangleSoup;
use std::path::Path;
use std::process::Command;

/// The name of a tree's file.
pub fn name_of(tree: &Path) -> String {
    tree.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A tree, flattened.
///
/// # Errors
/// When it cannot be read.
pub fn load_soup(tree: &Path) -> Result<TriangleSoup> {
    let block = Block::parse(&[tree.to_string_lossy().into_owned()])?;
    Ok(block.load(&Limits::default())?.model.flatten(50_000_000)?)
}

/// Standard output of the forest-bake beside this program.
///
/// # Errors
/// When it fails, with what it said.
pub fn program(args: &[&str]) -> Result<Vec<u8>> {
    program_named("forest-bake", args)
}

/// Standard output of a program beside this one.
///
/// # Errors
/// When it fails, with what it said.
pub fn program_named(name: &str, args: &[&str]) -> Result<Vec<u8>> {
    let program = std::env::current_exe()?.with_file_name(name);
    let output = Command::new(program).args(args).output()?;
    if !output.status.success() {
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        bail!("{name} {args:?}: {}: {error}", output.status);
    }
    Ok(output.stdout)
}
