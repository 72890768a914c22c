//! Where a bake spends its time.

use std::time::{Duration, Instant};

/// A stop-watch that adds up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stopwatch(Duration);

impl Stopwatch {
    /// Seconds so far.
    pub fn seconds(&self) -> f64 {
        self.0.as_secs_f64()
    }

    pub(crate) fn time<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.0 += start.elapsed();
        result
    }
}

/// Time by stage. Stages that run in cells, in parallel, are summed over threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageTimes {
    /// Textures to linear, premultiplied pyramids.
    pub shade: Stopwatch,
    /// Box, grid and cell lists.
    pub grid: Stopwatch,
    /// Duplicates, texture integrals, surfels (summed over threads).
    pub surfels: Stopwatch,
    /// Splitting and merging (summed over threads).
    pub cluster: Stopwatch,
    /// Sorting by size (summed over threads).
    pub sort: Stopwatch,
    /// Triangle records (summed over threads).
    pub triangles: Stopwatch,
    /// Writing sections, textures included.
    pub write: Stopwatch,
}

impl StageTimes {
    pub(crate) fn add(&mut self, o: &Self) {
        self.shade.0 += o.shade.0;
        self.grid.0 += o.grid.0;
        self.surfels.0 += o.surfels.0;
        self.cluster.0 += o.cluster.0;
        self.sort.0 += o.sort.0;
        self.triangles.0 += o.triangles.0;
        self.write.0 += o.write.0;
    }

    /// Names and watches, in the order of the pipeline.
    pub fn stages(&self) -> [(&'static str, Stopwatch); 7] {
        [
            ("shade", self.shade),
            ("grid", self.grid),
            ("surfels", self.surfels),
            ("cluster", self.cluster),
            ("sort", self.sort),
            ("triangles", self.triangles),
            ("write", self.write),
        ]
    }
}
