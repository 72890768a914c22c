//! A screen without a screen, for the window of `forest-view`.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

/// A virtual screen that writes what it shows to a file.
#[derive(Debug)]
pub struct Screen {
    server: std::process::Child,
    number: u32,
    folder: tempfile::TempDir,
}

impl Screen {
    /// Starts one of this size.
    ///
    /// # Panics
    /// When Xvfb is not there.
    pub fn start([width, height]: [u32; 2]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        // The server takes the first free number, and says which once it stands.
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &format!("{width}x{height}x24"), "-fbdir"])
            .arg(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb: the Makefile installs it");
        let mut line = String::new();
        let stdout = server.stdout.take().expect("a pipe");
        BufReader::new(stdout).read_line(&mut line).expect("Xvfb says its number");
        let number = line.trim().parse().expect("Xvfb starts");
        Self { server, number, folder }
    }

    /// Its number, as programs want it.
    pub fn display(&self) -> String {
        format!(":{}", self.number)
    }

    /// What is on the screen: an X window dump of 32 bits a pixel, blue first.
    ///
    /// # Panics
    /// When the server has ended.
    pub fn picture(&self) -> image::RgbImage {
        let bytes = std::fs::read(self.folder.path().join("Xvfb_screen0")).expect("a screen");
        let word = |i: usize| bytes[4 * i..][..4].iter().fold(0, |v, b| v << 8 | usize::from(*b));
        let (header, width, height, row, colors) = (word(0), word(4), word(5), word(12), word(19));
        let start = header + 12 * colors;
        image::RgbImage::from_fn(width as u32, height as u32, |x, y| {
            let at = start + y as usize * row + x as usize * 4;
            image::Rgb([bytes[at + 2], bytes[at + 1], bytes[at]])
        })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
