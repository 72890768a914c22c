//! Running jobs: each bake is a process of its own, so that none can take others with it.

use crate::cache::Cache;
use crate::error::BatchError;
use crate::event::{Done, Event, Line};
use crate::job::{Job, Reason};
use crate::state::{Failure, Held, Output, Record, State};
use crate::work::WorkFolder;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// How jobs are run.
#[derive(Clone, Debug)]
pub struct Runner {
    /// `forest-bake`.
    pub program: PathBuf,
    /// What names that program in keys ([`crate::baker`]).
    pub baker: String,
    /// Most jobs at once.
    pub jobs: usize,
    /// Threads for all jobs together.
    pub threads: usize,
    /// Memory for all jobs together, in bytes; a single job may always run.
    pub memory: u64,
    /// Start no job after one has failed.
    pub fail_fast: bool,
}

/// What became of a job.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// All was there.
    Current(Done),
    /// It was baked, or taken out of the cache.
    Baked(Done),
    /// It could not be baked.
    Failed(Failure),
    /// It was not tried, after another had failed.
    Left,
}

/// A job that runs.
struct Running {
    number: usize,
    child: Child,
    /// Open as long as this process lives: the bake ends with it.
    _stdin: Option<ChildStdin>,
    memory: u64,
    _held: Held,
    making: Option<WorkFolder>,
    /// What it said last.
    done: Option<Done>,
    failure: Option<Failure>,
    /// What it said that is no event: of a crash.
    noise: Vec<String>,
}

/// What bakes say, by the numbers of their jobs; `None` once they say nothing more.
type Said = (usize, Option<String>);

impl Runner {
    /// Runs `jobs`, with the reasons for which they are to be run (none: they are not), and tells what happens.
    ///
    /// # Errors
    /// When records or the cache cannot be written; what fails of a job is in its outcome.
    pub fn run(
        &self,
        jobs: &[(Job, Option<Reason>)],
        state: &State,
        cache: Option<&Cache>,
        tell: &mut dyn FnMut(&Line),
    ) -> Result<Vec<Outcome>, BatchError> {
        let mut outcomes: Vec<Option<Outcome>> = vec![None; jobs.len()];
        let mut waiting = VecDeque::new();
        for (i, (job, reason)) in jobs.iter().enumerate() {
            match reason {
                Some(_) => waiting.push_back(i),
                None => outcomes[i] = state.record(&job.asset.name).map(|r| known(job, r, tell)),
            }
        }
        // Each has its share of the threads.
        let threads = (self.threads / self.jobs.min(waiting.len()).max(1)).max(1);
        let memory = jobs.iter().map(|(job, _)| job.estimate(state).0).collect();
        let running = Vec::new();
        let mut batch = Batch { runner: self, jobs, memory, threads, state, cache, tell, running };
        let (sender, receiver) = channel();
        let mut failed = false;
        while !(waiting.is_empty() && batch.running.is_empty()) {
            if failed && self.fail_fast {
                waiting.drain(..).for_each(|i| outcomes[i] = Some(Outcome::Left));
            }
            batch.start(&mut waiting, &mut outcomes, &sender)?;
            for (i, outcome) in batch.wait(&receiver)? {
                failed |= matches!(outcome, Outcome::Failed(_));
                outcomes[i] = Some(outcome);
            }
        }
        Ok(outcomes.into_iter().map(|o| o.unwrap_or(Outcome::Left)).collect())
    }
}

/// What is known of a job that need not be run.
fn known(job: &Job, record: Record, tell: &mut dyn FnMut(&Line)) -> Outcome {
    let name = Some(&*job.asset.name);
    match record.outcome {
        Ok(done) => {
            tell(&Line::new(name, Event::Current { output: done.output.clone() }));
            Outcome::Current(done)
        }
        Err(failure) => {
            let Failure { error, code } = failure.clone();
            tell(&Line::new(name, Event::Failed { error, code }));
            Outcome::Failed(failure)
        }
    }
}

/// Time between looks at jobs that another run holds.
const PATIENCE: Duration = Duration::from_millis(100);

/// A run.
struct Batch<'a> {
    runner: &'a Runner,
    jobs: &'a [(Job, Option<Reason>)],
    /// What each is expected to need, in bytes.
    memory: Vec<u64>,
    /// Threads of a job.
    threads: usize,
    state: &'a State,
    cache: Option<&'a Cache>,
    tell: &'a mut dyn FnMut(&Line),
    running: Vec<Running>,
}

impl Batch<'_> {
    /// Starts as many of the jobs that wait as there is room for.
    fn start(
        &mut self,
        waiting: &mut VecDeque<usize>,
        outcomes: &mut [Option<Outcome>],
        sender: &Sender<Said>,
    ) -> Result<(), BatchError> {
        // Every job that waits is looked at once.
        for _ in 0..waiting.len() {
            if self.running.len() >= self.runner.jobs {
                return Ok(());
            }
            let Some(i) = waiting.pop_front() else { return Ok(()) };
            let (job, reason) = &self.jobs[i];
            let memory = self.memory[i];
            let taken: u64 = self.running.iter().map(|r| r.memory).sum();
            if !self.running.is_empty() && taken.saturating_add(memory) > self.runner.memory {
                waiting.push_back(i);
                continue;
            }
            // Another run may be at it, or have been.
            let Some(held) = self.state.hold(&job.asset.name)? else {
                waiting.push_back(i);
                continue;
            };
            let record = self.state.record(&job.asset.name);
            let forced = matches!(reason, Some(Reason::Forced));
            if !forced
                && let Some(record) = record
                && job.reason(Some(&record), &self.runner.baker).is_none()
            {
                outcomes[i] = Some(known(job, record, self.tell));
                continue;
            }
            if let Some(done) = self.cache.filter(|_| !forced).and_then(|c| c.find(&job.key)) {
                outcomes[i] = Some(self.finish(job, Ok(done), true)?);
                continue;
            }
            match self.spawn(i, memory, held, sender) {
                Ok(running) => self.running.push(running),
                Err(error) => {
                    let error = format!("{}: {error}", self.runner.program.display());
                    outcomes[i] =
                        Some(self.finish(job, Err(Failure { error, code: None }), false)?);
                }
            }
        }
        Ok(())
    }

    fn spawn(
        &self,
        number: usize,
        memory: u64,
        held: Held,
        sender: &Sender<Said>,
    ) -> Result<Running, BatchError> {
        let job = &self.jobs[number].0;
        let asset = &job.asset;
        let making = self.cache.map(Cache::make).transpose()?;
        let (output, exports) = match &making {
            Some(making) => {
                let name = asset.output.file_name().unwrap_or_default();
                (making.path().join(name), making.path().join("exports"))
            }
            None => (asset.output.clone(), asset.exports.clone()),
        };
        let mut command = Command::new(&self.runner.program);
        command
            .arg("all")
            .args(&asset.trees)
            .arg("-o")
            .arg(&output)
            .args(&job.arguments)
            .arg(format!("--name={}", asset.name))
            .arg("--export-to")
            .arg(&exports)
            .args(["--force", "--log=json", "--until-stdin-ends"])
            .arg(format!("--threads={}", self.threads))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let mut child = command.spawn().map_err(BatchError::io(&self.runner.program))?;
        let stdin = child.stdin.take();
        if let Some(stderr) = child.stderr.take() {
            let sender = sender.clone();
            std::thread::spawn(move || {
                // A bake may say what is no text, if it crashes.
                for line in BufReader::new(stderr).split(b'\n').map_while(Result::ok) {
                    let line = String::from_utf8_lossy(&line).into_owned();
                    if sender.send((number, Some(line))).is_err() {
                        return;
                    }
                }
                // Nobody listens once the run is over.
                let _ = sender.send((number, None));
            });
        }
        let (done, failure, noise) = (None, None, Vec::new());
        Ok(Running {
            number,
            child,
            _stdin: stdin,
            memory,
            _held: held,
            making,
            done,
            failure,
            noise,
        })
    }

    /// Hears what bakes say, and sees to those that end.
    fn wait(&mut self, receiver: &Receiver<Said>) -> Result<Vec<(usize, Outcome)>, BatchError> {
        let said = match receiver.recv_timeout(PATIENCE) {
            Ok(said) => said,
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return Ok(vec![]),
        };
        let (number, text) = said;
        let Some(at) = self.running.iter().position(|r| r.number == number) else {
            return Ok(vec![]);
        };
        let Some(text) = text else {
            let running = self.running.swap_remove(at);
            return Ok(vec![(number, self.end(running)?)]);
        };
        let running = &mut self.running[at];
        let name = &self.jobs[number].0.asset.name;
        match Line::read(&text).map(|l| l.event) {
            Some(Event::Done(done)) => running.done = Some(done),
            Some(Event::Failed { error, code }) => running.failure = Some(Failure { error, code }),
            Some(event) => (self.tell)(&Line::new(Some(name), event)),
            None if text.trim().is_empty() => {}
            None => running.noise.push(text),
        }
        Ok(vec![])
    }

    /// A bake has ended.
    fn end(&mut self, mut running: Running) -> Result<Outcome, BatchError> {
        let job = &self.jobs[running.number].0;
        let status = running.child.wait().map_err(BatchError::io(&self.runner.program))?;
        let failure = |running: &mut Running| match running.failure.take() {
            Some(failure) => failure,
            None => {
                let noise = running.noise.join("; ");
                let error = format!("forest-bake ended by {status}; it said: {noise}");
                Failure { error, code: status.code().and_then(|c| u8::try_from(c).ok()) }
            }
        };
        let made = match (status.success(), running.done.take()) {
            (true, Some(done)) => Ok(done),
            _ => Err(failure(&mut running)),
        };
        match (made, running.making, self.cache) {
            (Ok(done), Some(making), Some(cache)) => {
                cache.publish(&job.key, making, &done)?;
                let found = cache.find(&job.key).ok_or_else(|| {
                    let problem = format!("entry {} vanished", job.key);
                    BatchError::invalid(&done.output, "cache", problem)
                })?;
                self.finish(job, Ok(found), true)
            }
            (made, ..) => self.finish(job, made, false),
        }
    }

    /// Puts what was made where it belongs, and remembers it.
    fn finish(
        &mut self,
        job: &Job,
        made: Result<Done, Failure>,
        of_cache: bool,
    ) -> Result<Outcome, BatchError> {
        let name = Some(&*job.asset.name);
        let installed = made.and_then(|done| {
            let installed = if of_cache { install(&done, job) } else { Ok(done) };
            let looked = installed.and_then(|done| {
                let files = std::iter::once(&done.output).chain(&done.exports);
                let outputs = files.map(|f| Output::of(f)).collect::<std::io::Result<Vec<_>>>()?;
                Ok((done, outputs))
            });
            looked.map_err(|e| Failure { error: e.to_string(), code: Some(2) })
        });
        let before = self.state.record(&job.asset.name).map(|r| r.outputs).unwrap_or_default();
        let (outputs, outcome) = match installed {
            Ok((done, outputs)) => {
                // What an earlier bake exported, and this one does not.
                for old in before.iter().filter(|b| outputs.iter().all(|o| o.path != b.path)) {
                    if old.has_its_hash() {
                        std::fs::remove_file(&old.path).map_err(BatchError::io(&old.path))?;
                    }
                }
                (outputs, Ok(done))
            }
            // What is there of an earlier bake stays.
            Err(failure) => (before, Err(failure)),
        };
        let record = Record::new(job, &self.runner.baker, outputs, outcome.clone());
        self.state.put(&job.asset.name, &record)?;
        Ok(match outcome {
            Ok(done) => {
                (self.tell)(&Line::new(name, Event::Done(done.clone())));
                Outcome::Baked(done)
            }
            Err(failure) => {
                let Failure { error, code } = failure.clone();
                (self.tell)(&Line::new(name, Event::Failed { error, code }));
                Outcome::Failed(failure)
            }
        })
    }
}

/// Copies an entry of the cache to where the asset's files belong: exports first, the pack last.
fn install(done: &Done, job: &Job) -> std::io::Result<Done> {
    let mut exports = Vec::new();
    for from in &done.exports {
        let to = job.asset.exports.join(from.file_name().unwrap_or_default());
        copy(from, &to)?;
        exports.push(to);
    }
    let output = job.asset.output.clone();
    copy(&done.output, &output)?;
    Ok(Done { output, exports, ..done.clone() })
}

fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    if let Some(folder) = to.parent() {
        std::fs::create_dir_all(folder)?;
    }
    forest_pack::copy_whole(from, to)
}
