//! The source's pictures, drawn by a thread of their own: the window does not wait for them.

use crate::truth::Truth;
use anyhow::{Context, Result};
use forest_raster::{Light, Picture};
use forest_soup::Camera;
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

/// What a picture is of: camera, light, samples along the side of a pixel.
pub(crate) type Request = (Camera, Light, u32);

/// A thread that draws the source for the camera that was asked for last.
#[derive(Debug)]
pub(crate) struct TruthWorker {
    requests: Sender<Request>,
    pictures: Receiver<(Request, Picture)>,
    asked: Option<Request>,
}

impl TruthWorker {
    /// Reads the tree and starts the thread; `shadows` is that of [`Truth::load`].
    pub(crate) fn start(path: &Path, max_triangles: u64, shadows: bool) -> Result<Self> {
        let truth = Truth::load(path, max_triangles, shadows)?;
        let (requests, inbox) = channel::<Request>();
        let (outbox, pictures) = channel();
        std::thread::Builder::new().name("truth".into()).spawn(move || {
            while let Ok(mut request) = inbox.recv() {
                // Only the last one counts.
                while let Ok(newer) = inbox.try_recv() {
                    request = newer;
                }
                let (camera, light, side) = request;
                if outbox.send((request, truth.picture(&camera, &light, side))).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { requests, pictures, asked: None })
    }

    /// Asks for a picture, unless it is the one that was asked for last.
    pub(crate) fn ask(&mut self, request: Request) {
        if self.asked != Some(request) {
            self.asked = Some(request);
            // A thread that has ended says so when pictures are taken.
            let _ = self.requests.send(request);
        }
    }

    /// The newest picture that is ready.
    ///
    /// # Errors
    /// When the thread has ended.
    pub(crate) fn take(&mut self) -> Result<Option<(Request, Picture)>> {
        let mut newest = None;
        loop {
            match self.pictures.try_recv() {
                Ok(picture) => newest = Some(picture),
                Err(TryRecvError::Empty) => return Ok(newest),
                Err(e) => return Err(e).context("the source cannot be drawn any more"),
            }
        }
    }
}
