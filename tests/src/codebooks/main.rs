//! `codebooks [TREE…]`: trains codebooks of the trees' textures with this workspace and with its
//! peers, faiss and scikit-learn, and prints a Markdown table. Peers run if `$PYTHON` (python3) has
//! both: `pip install faiss-cpu scikit-learn`.
//!
//! All train on the same vectors and by turns, five times each; seconds are medians of training alone.
//! Distortions are computed here, from the words, for all alike.

mod blocks;

use anyhow::{Context, Result, bail, ensure};
use blocks::{DIMENSION, lab_blocks};
use forest_tests::report_trees;
use forest_vq::{Centers, Codebook, TrainOptions, Training, Vectors, assign, train};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

const VECTORS: usize = 150_000;
const WORDS: usize = 512;
const ROUNDS: u32 = 20;
const RUNS: u64 = 5;
const PEERS: [&str; 3] = ["faiss", "lloyd", "elkan"];
const SAMPLES: [&str; 2] = ["conifer.glb", "broadleaf_young.gltf"];
const SHARED: [&str; 6] = [
    "ez_ash_medium.glb",
    "ez_oak_dense_200k.glb",
    "ez_oak_wrapped_u16.glb",
    "sap_birch_200k.glb",
    "sap_jmaple_450k.glb",
    "sap_pine_20k.glb",
];

fn main() -> Result<()> {
    let mut trees: Vec<PathBuf> = std::env::args().skip(1).map(PathBuf::from).collect();
    if trees.is_empty() {
        trees = report_trees(&[], &SHARED);
    }
    if trees.is_empty() {
        trees = report_trees(&SAMPLES, &[]);
    }
    let vectors = lab_blocks(&trees, VECTORS)?;
    ensure!(vectors.len() > WORDS, "only {} blocks", vectors.len());
    let all = std::thread::available_parallelism()?.get();
    let peers = peers_are_there();
    if !peers {
        eprintln!("peers are missing: `{} -c 'import faiss, sklearn'` fails", python());
    }
    println!(
        "# Codebook training beside faiss and scikit-learn\n\nWritten by `make codebooks`, on the machine \
         named in BENCH.md. *Ours gets there in*: seconds until our distortion is\nno larger than the \
         peer's at its end, and rounds over all vectors in them.\n"
    );
    println!(
        "{} distinct blocks of 4 × 4 texels from {} trees, {DIMENSION} numbers each (CIELab), {WORDS} \
         words, seeds 1 … {RUNS}; medians of {RUNS} runs by turns.\n",
        vectors.len(),
        trees.len(),
    );
    let counts = if all > 1 { vec![1, all] } else { vec![1] };
    for threads in counts {
        table(&vectors, threads, peers)?;
    }
    Ok(())
}

fn python() -> String {
    std::env::var("PYTHON").unwrap_or_else(|_| "python3".into())
}

fn peers_are_there() -> bool {
    let import = Command::new(python()).args(["-c", "import faiss, sklearn"]).output();
    import.is_ok_and(|o| o.status.success())
}

/// Runs of one contender.
#[derive(Clone, Default)]
struct Runs {
    seconds: Vec<f64>,
    distortions: Vec<f64>,
}

impl Runs {
    fn seconds(&self) -> f64 {
        median(&self.seconds)
    }

    fn distortion(&self) -> f64 {
        median(&self.distortions)
    }
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A training with `threads`, and its seconds.
fn ours(vectors: &Vectors, options: &TrainOptions, threads: usize) -> Result<(Training, f64)> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let start = Instant::now();
    let training = pool.install(|| train(vectors, None, options))?;
    Ok((training, start.elapsed().as_secs_f64()))
}

fn table(vectors: &Vectors, threads: usize, peers: bool) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("vectors.f32");
    std::fs::write(&file, bytemuck::cast_slice(vectors.values()))?;
    let options = |seed, iterations, tolerance| TrainOptions {
        codewords: WORDS,
        iterations,
        tolerance,
        seed,
        centers: Centers::Mean,
        ..TrainOptions::default()
    };
    let mut others: Vec<(&str, Runs)> = PEERS.map(|p| (p, Runs::default())).into();
    others.retain(|_| peers);
    let mut own = Runs::default();
    let (mut shares, mut nearest) = (Vec::new(), Runs::default());
    for seed in 1..=RUNS {
        for (method, runs) in &mut others {
            let (book, seconds) = peer(&file, method, seed, threads)?;
            runs.seconds.push(seconds);
            runs.distortions.push(distortion(&book, vectors));
        }
        let (training, seconds) = ours(vectors, &options(seed, ROUNDS, 0.0), threads)?;
        own.seconds.push(seconds);
        own.distortions.push(distortion(&training.codebook, vectors));
        shares.push(share(&training));
        let words_of_vectors = TrainOptions { seed, ..TrainOptions::default() };
        let (training, seconds) = ours(vectors, &words_of_vectors, threads)?;
        nearest.seconds.push(seconds);
        nearest.distortions.push(training.distortion);
    }
    // What the others end with is a target for all; ours stops at the first round that is there.
    let targets: Vec<f64> = others.iter().map(|(_, r)| r.distortion()).collect();
    let mut reached = vec![Runs::default(); targets.len()];
    let mut rounds = vec![Vec::new(); targets.len()];
    for seed in 1..=RUNS {
        let (long, _) = ours(vectors, &options(seed, 100, 0.0), threads)?;
        for (i, &target) in targets.iter().enumerate() {
            let Some(first) = long.history.iter().position(|d| *d <= target) else { continue };
            let first = first as u32 + 1;
            let (_, seconds) = ours(vectors, &options(seed, first, 0.0), threads)?;
            reached[i].seconds.push(seconds);
            rounds[i].push(f64::from(first));
        }
    }
    println!(
        "| {threads} threads | seconds | distortion | ours gets there in | rounds | times as fast |"
    );
    println!("|---|---|---|---|---|---|");
    for (i, (method, runs)) in others.iter().enumerate() {
        let name = if *method == "faiss" { "faiss" } else { &format!("scikit-learn, {method}") };
        let (s, d) = (runs.seconds(), runs.distortion());
        // Half the seeds or more must get there.
        if reached[i].seconds.len() * 2 <= RUNS as usize {
            println!("| {name}, {ROUNDS} rounds | {s:.3} | {d:.2} | never | | |");
            continue;
        }
        let own = reached[i].seconds();
        let rounds = median(&rounds[i]);
        println!(
            "| {name}, {ROUNDS} rounds | {s:.3} | {d:.2} | {own:.3} s | {rounds:.0} | {:.1} |",
            s / own
        );
    }
    let (s, d) = (own.seconds(), own.distortion());
    println!("| ours, {ROUNDS} rounds | {s:.3} | {d:.2} | | | |");
    let (s, d) = (nearest.seconds(), nearest.distortion());
    println!("| ours, words of vectors | {s:.3} | {d:.2} | | | |");
    let share = 100.0 * median(&shares);
    println!(
        "\nOurs computed {share:.2} % of vectors × words × rounds distances, samples included.\n"
    );
    Ok(())
}

/// Distances computed, of those that plain rounds would take.
fn share(training: &Training) -> f64 {
    let rounds = training.history.len() as f64;
    let plain = training.indices.len() as f64 * training.codebook.len() as f64 * rounds;
    training.distances as f64 / plain
}

/// A codebook of a peer, and the seconds that it took.
fn peer(file: &Path, method: &str, seed: u64, threads: usize) -> Result<(Codebook, f64)> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/kmeans.py");
    let words = file.with_extension("words");
    let threads = threads.to_string();
    let output = Command::new(python())
        .arg(script)
        .args([file, &words])
        .args([DIMENSION, WORDS, ROUNDS as usize, seed as usize].map(|n| n.to_string()))
        .arg(method)
        .envs(["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"].map(|n| (n, &threads)))
        .output()?;
    if !output.status.success() {
        bail!("{method}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let text = String::from_utf8(output.stdout)?;
    let seconds = text.lines().last().context("no seconds")?.trim().parse()?;
    let words = std::fs::read(words)?;
    let words = words.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    Ok((Codebook::new(DIMENSION, words)?, seconds))
}

/// Mean of the squared distances of vectors and their nearest words.
fn distortion(book: &Codebook, vectors: &Vectors) -> f64 {
    let nearest = assign(book, vectors);
    let of = |(i, w): (usize, &u32)| -> f64 {
        let pairs = vectors.row(i).iter().zip(book.word(*w as usize));
        pairs.map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum()
    };
    nearest.iter().enumerate().map(of).sum::<f64>() / vectors.len() as f64
}
