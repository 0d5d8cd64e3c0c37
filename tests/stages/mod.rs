//! Tests of whole runs: killed, stopped, continued, branched and damaged runs, and relations between the tables of all kinds of runs.

mod again;
mod alone;
mod checkpoint;
mod cycle_fields;
mod decks;
mod drawn;
mod drives;
mod durability;
mod energy;
mod error_bars;
mod extremes;
mod faults;
mod forced;
mod half_grid;
mod invariants;
mod keys;
mod kill;
mod kinds;
mod laws;
mod lost_resonance;
mod maps;
mod matrices;
mod modes;
mod orbits;
mod pace;
mod pressed;
mod resume;
mod shared;
mod sibling;
mod stop;
mod twisting;
mod updates;
mod vibrating;

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::recipe::Inputs;
use fretwear::scene::Plan;
use fretwear::scene::Scene;
use fretwear::stages::{Observer, Outcome, Progress, RunError, RunOptions, Source, Stage, run};
use fretwear::store::{Cache, FileSystem, Opening};

use crate::support::faulty::FaultyFileSystem;

/// Run in the process of the test.
struct Start<'a> {
    scene: Scene,
    root: &'a Path,
    source: Option<(&'a Path, u64)>,
    until: Option<Stage>,
    commits: u64,
    cache: Option<PathBuf>,
    file_system: Arc<dyn FileSystem>,
}

impl<'a> Start<'a> {
    fn new(scene: Scene, root: &'a Path) -> Self {
        Start {
            scene,
            root,
            source: None,
            until: None,
            commits: u64::MAX,
            cache: None,
            // This file system does not wait for the disk.
            file_system: Arc::new(FaultyFileSystem::sound()),
        }
    }

    fn from(mut self, run: &'a Path, wear_iteration: u64) -> Self {
        self.source = Some((run, wear_iteration));
        self
    }

    fn until(mut self, stage: Stage) -> Self {
        self.until = Some(stage);
        self
    }

    /// Stops the run after the given number of commits.
    fn stopped_after(mut self, commits: u64) -> Self {
        self.commits = commits;
        self
    }

    fn sharing(mut self, cache: PathBuf) -> Self {
        self.cache = Some(cache);
        self
    }

    fn through(mut self, file_system: Arc<dyn FileSystem>) -> Self {
        self.file_system = file_system;
        self
    }

    fn run(self) -> (Result<Outcome, RunError>, Seen) {
        let plan = Plan::of(&self.scene);
        self.run_inputs(&plan.unwrap_or_else(|error| panic!("{error}")).inputs)
    }

    fn run_inputs(self, inputs: &Inputs) -> (Result<Outcome, RunError>, Seen) {
        let seen = Seen::default();
        let result = {
            let source = self.source.map(|(run, wear_iteration)| Source {
                run: PathBuf::from(run),
                wear_iteration,
            });
            let most = self.commits;
            let options = RunOptions {
                inputs,
                root: self.root.to_owned(),
                source,
                until: self.until,
                threads: 1,
                cache: self
                    .cache
                    .map(|root| Cache::new(self.file_system.clone(), &root)),
                file_system: self.file_system,
                stop: &|commits| commits >= most,
            };
            run(&options, &seen)
        };
        (result, seen)
    }

    /// Runs the scene and expects success.
    fn done(self) -> (Outcome, Seen) {
        let (result, seen) = self.run();
        (result.unwrap_or_else(|error| panic!("{error}")), seen)
    }

    /// Runs the scene, expects an error, and returns its message.
    fn refused(self) -> String {
        match Plan::of(&self.scene) {
            Err(error) => error.to_string(),
            Ok(plan) => match self.run_inputs(&plan.inputs).0 {
                Ok(_) => panic!("the scene was accepted"),
                Err(error) => error.to_string(),
            },
        }
    }
}

/// Record of the messages to an observer of a run.
#[derive(Default)]
struct Seen {
    stages: RefCell<Vec<(Stage, u64)>>,
    committed: RefCell<Vec<u64>>,
    notices: RefCell<Vec<String>>,
}

impl Observer for Seen {
    fn opened(&self, opening: &Opening) {
        self.notices.borrow_mut().extend(opening.notices());
    }
    fn notice(&self, text: &str) {
        self.notices.borrow_mut().push(text.to_owned());
    }
    fn stage(&self, stage: Stage, wear_iteration: u64) {
        self.stages.borrow_mut().push((stage, wear_iteration));
    }
    fn committed(&self, progress: &Progress) {
        self.committed.borrow_mut().push(progress.wear_iteration);
    }
}
