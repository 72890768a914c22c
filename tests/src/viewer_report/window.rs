//! The README's pictures of the viewer.

use anyhow::{Result, bail};
use forest_tests::screen::Screen;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

const SIZE: [u32; 2] = [1100, 620];

/// Writes docs/view_window.png, what a screen shows, and docs/view_all.png, what headless runs write.
pub(crate) fn write(root: &Path, pack: &Path, tree: &Path) -> Result<()> {
    let program = std::env::current_exe()?.with_file_name("forest-view");
    let screen = Screen::start(SIZE);
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    // By its bare name, as a user would type it.
    let folder = pack.parent().unwrap_or(Path::new("."));
    let shown = folder.join("broadleaf.fpack");
    std::fs::copy(pack, &shown)?;
    let tree = tree.canonicalize()?;
    let mut child = Command::new(&program)
        .current_dir(folder)
        .args(["broadleaf.fpack", "--size", &size, "--view", "30,10", "--truth"])
        .arg(tree)
        .env("DISPLAY", screen.display())
        .env_remove("WAYLAND_DISPLAY")
        .spawn()?;
    std::thread::sleep(Duration::from_secs(20));
    let picture = screen.picture();
    child.kill()?;
    child.wait()?;
    picture.save(root.join("docs/view_window.png"))?;
    let side = 300;
    let mut sheet = image::RgbImage::new(3 * side, side);
    for (i, what) in ["points", "views", "volume"].into_iter().enumerate() {
        let png = folder.join(format!("{what}.png"));
        let size = format!("{side}x{side}");
        let output = Command::new(&program)
            .arg(&shown)
            .args([
                "--headless",
                "--as",
                what,
                "--size",
                &size,
                "--view",
                "30,10",
                "--samples",
                "4",
            ])
            .arg("-o")
            .arg(&png)
            .output()?;
        if !output.status.success() {
            bail!("forest-view: {}", String::from_utf8_lossy(&output.stderr));
        }
        let picture = image::open(&png)?.into_rgb8();
        image::imageops::replace(&mut sheet, &picture, i64::from(side) * i as i64, 0);
    }
    sheet.save(root.join("docs/view_all.png"))?;
    Ok(())
}
