//! `forest-bake completions` and `forest-bake man`: for shells and packagers, from what `--help` says.

use crate::output;
use anyhow::{Context, Result};
use clap::CommandFactory;
use clap_complete::Shell;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct CompletionsArgs {
    /// Which shell.
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(clap::Args)]
pub(crate) struct ManArgs {
    /// Folder to write a page for each command to; it is made if it is missing.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

pub(crate) fn completions(args: &CompletionsArgs) -> Result<()> {
    let mut command = crate::Args::command();
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut command, "forest-bake", &mut text);
    Ok(output::print(&String::from_utf8(text)?)?)
}

pub(crate) fn man(args: &ManArgs) -> Result<()> {
    let folder = &args.folder;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    clap_mangen::generate_to(crate::Args::command(), folder)
        .with_context(|| folder.display().to_string())
}
