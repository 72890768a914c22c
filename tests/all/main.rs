//! One test binary; a line a module says what belongs there.

mod architecture; // the arrows between crates, licences, one version of what must be one
mod batch; // many assets: what is baked again, kills, caches, workflow engines
mod blocks; // several trees baked together
mod cli; // the program: usage, exit codes, what it prints, what it leaves behind
mod damaged; // damaged files through the program
mod eval; // packs against their sources: reports, calibration, chosen levels
mod foliage; // foliage: wood and leaves, levels, wind
mod foliage_export; // foliage as glb, branches as textures
mod fuzz_corpus; // inputs that fuzzing found or started from
mod goldens; // committed packs: read, damaged, baked again
mod gpu; // the graphics device against the CPU renderer, sample by sample
mod ground_truth; // the pictures that packs are judged against: two ways, and another's
mod hard_cases; // degenerate and extreme soups, each with its expected number
mod invariance; // threads, places and scales that must not matter
mod landscape; // landscapes: made, drawn, beside ground truth
mod light; // as bright as rays with shadows say, by every representation
mod real_trees; // trees by others, where they are present
mod support; // temporary folders, running the program
mod view; // forest-view: pictures, window, exit codes
mod views; // views: what the program bakes, hard cases
mod views_export; // what engines read
mod volume; // volumes: from meshes and photographs, order, hard cases
