//! With `output.durability = "end"`, the run waits for the disk once, at its end. The files of the run are the same.

use std::fs;
use std::sync::Arc;

use fretwear::store::FileSystem;

use super::Start;
use crate::support::faulty::{Fault, FaultyFileSystem};
use crate::support::{Bench, assert_same, content, verified};

const SHORT: &str = "wear.cycles=200_000";

#[test]
fn a_run_that_waits_at_its_end_leaves_the_same_and_survives_a_loss_of_power_after_it() {
    let bench = Bench::new();
    let [usual, late] = ["usual", "late"].map(|name| bench.path(name));
    Start::new(bench.scene("small.toml", &[SHORT]), &usual).done();
    let scene = || bench.scene("small.toml", &[SHORT, "output.durability=end"]);
    let sound = Arc::new(FaultyFileSystem::sound());
    Start::new(scene(), &late).through(sound.clone()).done();
    assert_same(&content(&late), &content(&usual), "at the end");

    // The power fails at the first change after the end of the run, and not before.
    let calls = sound.calls(Fault::PowerLoss);
    fs::remove_dir_all(&late).expect("removed");
    let losing = Arc::new(FaultyFileSystem::failing(calls + 1, Fault::PowerLoss));
    Start::new(scene(), &late).through(losing.clone()).done();
    let stray = losing.write_new(&bench.path("stray"), b"more");
    stray.expect_err("the loss of power");
    losing.settle();
    verified(&late);
    assert_same(&content(&late), &content(&usual), "after a loss of power");
}

/// A restart may change this key in either direction.
#[test]
fn a_run_goes_on_with_the_other_choice() {
    let bench = Bench::new();
    for [first, then] in [["commit", "end"], ["end", "commit"]] {
        let root = bench.path(first);
        let set = |word| format!("output.durability={word}");
        let (first, then) = (set(first), set(then));
        Start::new(bench.scene("small.toml", &[SHORT, &first]), &root).done();
        let longer = Start::new(bench.scene("small.toml", &[&then]), &root);
        longer.done();
        verified(&root);
    }
}
