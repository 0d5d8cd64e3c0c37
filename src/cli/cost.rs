//! Expected cost of a run, and cost of a completed run.

use std::path::Path;

use fretwear::recipe::{Inputs, ResourceEstimate};
use fretwear::rehearsal::{Range, Rehearsal};
use fretwear::stages::RunCost;
use serde_json::{Value, json};

use crate::terminal::Results;

/// Prints the expected cost of a scene.
pub fn write_expected(out: &mut Results, rehearsal: &Rehearsal) {
    let cost = &rehearsal.cost;
    let counted = &cost.counted;
    let mut line = |name: &str, text: String| writeln!(out, "    {name:<13} {text}");
    let cached = counted.memory_cached.map_or_else(String::new, |cached| {
        format!("; {} with the structure in the cache", megabytes(cached))
    });
    line("memory", format!("{}{cached}", megabytes(counted.memory)));
    if counted.unknowns > 0 {
        let unknowns = counted.unknowns;
        line(
            "unknowns",
            format!("at most {unknowns}, in the harmonic balance"),
        );
    }
    let per_iteration = megabytes(counted.disk_per_iteration);
    let disk = cost.disk.map_or_else(String::new, |disk| {
        format!("; {} in all", range(disk, |bytes| megabytes(bytes as u64)))
    });
    line("disk", format!("{per_iteration} per iteration{disk}"));
    if let Some(why) = &cost.not_known {
        line(
            "not known",
            format!("iterations, FFT pairs, time and total disk: {why}"),
        );
    }
    let number = |value: f64| format!("{value:.0}");
    if let Some(iterations) = cost.iterations.filter(|estimate| estimate.expected > 0.0) {
        line("iterations", range(iterations, number));
    }
    if let Some(pairs) = cost.fft_pairs.filter(|estimate| estimate.expected > 0.0) {
        line("FFT pairs", range(pairs, number));
    }
    if let Some(seconds) = rehearsal.seconds {
        let seconds = range(seconds, |seconds| format!("{seconds:.1} s"));
        line("time", format!("{seconds}, one thread of this machine"));
    }
    if let Some(run) = cost.coarse_run {
        let cells = match run.cells {
            [0, 0] => String::new(),
            [x, y] => format!(", on {x} x {y} cells"),
        };
        line(
            "rehearsal",
            format!("{:.1} s{cells}", rehearsal.seconds_taken),
        );
    }
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

/// Describes the cost of a completed run in a few words.
pub fn cost_text(spent: &RunCost) -> String {
    let mut parts = Vec::new();
    if spent.wear_iterations > 0 {
        parts.push(format!("{} iterations", spent.wear_iterations));
    }
    if spent.total_pairs() > 0.0 {
        parts.push(format!("{:.0} FFT pairs", spent.total_pairs()));
    }
    parts.push(format!("{:.1} s", spent.total_seconds()));
    parts.push(format!("{} of disk", megabytes(spent.disk)));
    parts.join(", ")
}

/// Describes the peak memory of the running process. Returns `None` if the system does not report the peak memory.
pub fn memory_in_words() -> Option<String> {
    Some(format!("{} of memory", megabytes(peak_memory()?)))
}

/// Returns the cost of a finished run as JSON.
pub fn cost_json(spent: &RunCost) -> Value {
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

/// Returns a warning if a run needs more memory than the machine has.
pub fn memory_warning(inputs: &Inputs) -> Option<String> {
    let least = ResourceEstimate::least_memory(inputs);
    let machine = read_system_memory("/proc/meminfo", "MemTotal:")?;
    (least > machine).then(|| {
        format!(
            "joint.grid, structure: the run needs about {} of memory, but this machine has {}: use fewer cells, or a larger machine",
            megabytes(least),
            megabytes(machine)
        )
    })
}

/// Returns the memory \[B\] that the running process and its children may still take. The memory is the free memory of
/// the machine, limited by the control group of the process. Returns `None` if the system does not report the free
/// memory.
pub fn free_memory() -> Option<u64> {
    let free = read_system_memory("/proc/meminfo", "MemAvailable:")?;
    Some(group_memory().map_or(free, |group| group.min(free)))
}

/// Returns the memory limit of the control group (cgroup version 2) of the running process.
fn group_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let group = text.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let path = Path::new("/sys/fs/cgroup").join(group).join("memory.max");
    std::fs::read_to_string(path).ok()?.trim().parse().ok()
}

/// Returns the peak memory of the running process \[B\], or `None` if the system does not report the peak memory.
fn peak_memory() -> Option<u64> {
    read_system_memory("/proc/self/status", "VmHWM:")
}

/// Reads the value of a name in a file of the system \[B\].
fn read_system_memory(path: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}
