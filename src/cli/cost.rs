//! What a run will cost, and what it has cost.

use std::path::Path;
use std::time::Duration;

use fretwear::recipe::Inputs;
use fretwear::rehearsal::{self, Cost, Options, Range, Rehearsal};
use fretwear::scene::Plan;
use fretwear::stages::RunCost;
use serde_json::{Value, json};

use super::run::cache_folder;
use crate::progress::{duration, expected_seconds};
use crate::terminal::Results;

/// Time after which a rehearsal ends \[s\].
const LONGEST_REHEARSAL: Duration = Duration::from_secs(5);

/// Rehearses what a scene needs, for its cost.
pub fn rehearsed(plan: &Plan) -> Rehearsal {
    let options = Options {
        cache: cache_folder(),
        most: LONGEST_REHEARSAL,
    };
    rehearsal::rehearse(&plan.inputs, &options)
}

/// Seconds of a whole run by what such runs take, as the run itself will say at its beginning: where a rehearsal does not say them.
pub fn whole(plan: &Plan, rehearsal: &Rehearsal) -> Option<f64> {
    let is_known = rehearsal.seconds.is_some_and(|s| s.response.is_some());
    let vibrates = rehearsal.cost.contact_elements > 0;
    (vibrates && !is_known)
        .then(|| expected_seconds(&plan.inputs.recipe))
        .flatten()
}

/// Prints what a scene will cost here: its whole time, if that is told otherwise than by the rehearsal.
pub fn write_expected(out: &mut Results, rehearsal: &Rehearsal, whole: Option<f64>) {
    let Cost {
        memory,
        memory_cached,
        unknowns,
        ..
    } = rehearsal.cost;
    let cost = &rehearsal.cost;
    let mut line = |name: &str, text: String| writeln!(out, "    {name:<13} {text}");
    let cached = memory_cached.map_or_else(String::new, |cached| {
        format!("; {} with the structure in the cache", megabytes(cached))
    });
    line("memory", format!("{}{cached}", megabytes(memory)));
    if unknowns > 0 {
        line(
            "unknowns",
            format!("{unknowns} of the harmonic balance at most"),
        );
    }
    let number = |value: f64| format!("{value:.0}");
    if let Some(iterations) = cost.iterations.filter(|found| found.expected > 0.0) {
        let text = range(iterations, number);
        line(
            "iterations",
            format!("{text}; decided step by step, by the error of each"),
        );
    }
    if let Some(vibrations) = cost.vibrations {
        line("vibrations", format!("about {vibrations:.0}"));
    }
    if let Some(disk) = cost.disk {
        line("disk", range(disk, |bytes| megabytes(bytes as u64)));
    }
    if let Some(pairs) = cost.fft_pairs.filter(|found| found.expected > 0.0) {
        line("FFT pairs", range(pairs, number));
    }
    if let (Some(whole), None) = (whole, rehearsal.seconds) {
        line("time", by_prior(whole, ""));
    }
    if let Some(seconds) = rehearsal.seconds {
        let parts = [
            (
                "at least, structure, unless it is in the cache",
                seconds.structure,
            ),
            ("contact and wear", seconds.contact),
            ("vibration", seconds.response.unwrap_or(0.0)),
        ];
        let parts: Vec<String> = parts
            .iter()
            .filter(|(_, s)| *s >= 0.05)
            .map(|(name, s)| format!("{name} {s:.1} s"))
            .collect();
        let joined = parts.join(", ");
        let parts = if parts.len() > 1 {
            format!(" ({joined})")
        } else {
            String::new()
        };
        let unknown = if cost.contact_elements > 0 && seconds.response.is_none() {
            ", and the vibration"
        } else {
            ""
        };
        // Of what takes its time with pairs.
        let [least, most] = cost.fft_pairs.map_or([1.0; 2], |pairs| {
            [pairs.least, pairs.most].map(|bound| bound / pairs.expected.max(1.0))
        });
        let with = |part: f64| seconds.total() + (part - 1.0) * seconds.contact;
        let time = Range {
            expected: seconds.total(),
            least: with(least),
            most: with(most),
        };
        let time = range(time, |seconds| format!("{seconds:.1} s"));
        let rehearsed = format!("{time}{unknown} here, one thread{parts}");
        let text = whole.map_or(rehearsed, |whole| {
            by_prior(whole, &format!("; rehearsed: {joined}"))
        });
        line("time", text);
    }
    let grids: Vec<String> = cost
        .rehearsed
        .iter()
        .filter(|grid| grid.cells[0] > 0)
        .map(|grid| format!("{} x {}", grid.cells[0], grid.cells[1]))
        .collect();
    let grids = if grids.is_empty() {
        String::new()
    } else {
        format!(", on {} cells", grids.join(" and "))
    };
    line("rehearsed", format!("in {:.1} s{grids}", rehearsal.took));
    for why in &cost.not_rehearsed {
        line("not rehearsed", why.clone());
    }
}

fn by_prior(whole: f64, rehearsed: &str) -> String {
    let whole = duration(whole);
    format!("about {whole} with the vibration, by what such runs take{rehearsed}")
}

fn range(range: Range, text: impl Fn(f64) -> String) -> String {
    let Range {
        expected,
        least,
        most,
    } = range;
    if least == most {
        return text(expected);
    }
    format!(
        "about {} ({} to {})",
        text(expected),
        text(least),
        text(most)
    )
}

/// What a finished run has cost, as one line.
pub fn in_words(spent: &RunCost) -> String {
    let mut parts = Vec::new();
    if spent.wear_iterations > 0 {
        parts.push(format!("{} iterations", spent.wear_iterations));
    }
    if spent.total_pairs() > 0.0 {
        parts.push(format!("{:.0} FFT pairs", spent.total_pairs()));
    }
    parts.push(format!("{:.1} s", spent.total_seconds()));
    parts.push(format!("{} of disk", megabytes(spent.disk)));
    if let Some(peak) = peak_memory() {
        parts.push(format!("{} of memory", megabytes(peak)));
    }
    format!("  {:<24} {}", "cost", parts.join(", "))
}

/// What a finished run has cost, for programs.
pub fn spent(spent: &RunCost) -> Value {
    json!({
        "wear_iterations": spent.wear_iterations,
        "pruned_iterations": spent.pruned,
        "fft_pairs": spent.total_pairs(),
        "fft_pairs_by_stage": spent.fft_pairs,
        "disk_bytes": spent.disk,
        "seconds": spent.total_seconds(),
    })
}

fn megabytes(bytes: u64) -> String {
    let megabytes = bytes as f64 / 1e6;
    if megabytes < 10.0 {
        format!("{megabytes:.2} MB")
    } else {
        format!("{megabytes:.0} MB")
    }
}

/// What to say of a run that takes more memory than this machine has.
pub fn too_large(inputs: &Inputs) -> Option<String> {
    let (peak, cached) = rehearsal::memory(inputs);
    let least = cached.unwrap_or(peak).min(peak);
    let machine = told_by_system("/proc/meminfo", "MemTotal:")?;
    (least > machine).then(|| {
        format!(
            "joint.grid, structure: the run takes some {} of memory, and this machine has {}: fewer cells, or a larger machine",
            megabytes(least),
            megabytes(machine)
        )
    })
}

/// Memory that this process and those that it starts may still take \[B\]: what the machine has free, and what the group of processes that
/// an engine has put this one into may have; none where the system does not tell.
pub fn free_memory() -> Option<u64> {
    let free = told_by_system("/proc/meminfo", "MemAvailable:")?;
    Some(group_memory().map_or(free, |group| group.min(free)))
}

/// The limit of the control group of this process (version 2).
fn group_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let group = text.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let path = Path::new("/sys/fs/cgroup").join(group).join("memory.max");
    std::fs::read_to_string(path).ok()?.trim().parse().ok()
}

/// High-water mark of this process's memory \[B\], where the system tells.
fn peak_memory() -> Option<u64> {
    told_by_system("/proc/self/status", "VmHWM:")
}

/// Memory that a file of the system tells under a name \[B\].
fn told_by_system(path: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}
