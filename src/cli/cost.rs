//! What a run is expected to cost on this machine, and what it has cost.

use fretwear::contact::HalfSpace;
use fretwear::doctor;
use fretwear::grid::Grid;
use fretwear::recipe::{Contact, Surface};
use fretwear::scene::Plan;
use fretwear::scene::plan::Rates;
use fretwear::stages::{Spent, Stage};
use serde_json::{Value, json};

use crate::terminal::Results;

/// How fast this machine is, as far as the cost asks.
fn rates(plan: &Plan) -> Rates {
    let (cost, recipe) = (&plan.cost, &plan.inputs.recipe);
    let rough = recipe.surface().zip(recipe.contact());
    let dense = cost.structure_operations + cost.response_operations;
    Rates {
        pair: rough.map_or(0.0, |(surface, contact)| seconds_of_pair(surface, contact)),
        operation: if dense > 0.0 {
            doctor::seconds_of_operation()
        } else {
            0.0
        },
    }
}

/// Cells along a side of the largest plane that is measured: the scene that is planned may be more than the machine holds.
const LARGEST_MEASURED: usize = 1024;

/// A pair of transforms on this scene's plane \[s\]. That of a larger plane than is measured follows as n log n.
fn seconds_of_pair(surface: &Surface, contact: &Contact) -> f64 {
    let asked = surface.grid();
    let counts = [asked.nx, asked.ny].map(|n| n.min(LARGEST_MEASURED));
    let measured = Grid::over(
        [asked.nx as f64 * asked.dx, asked.ny as f64 * asked.dy],
        counts,
    );
    let mut half_space = HalfSpace::new(measured, contact.bodies, contact.boundary);
    let operations = |grid: Grid| grid.len() as f64 * (grid.len() as f64).log2();
    let ratio = if counts == [asked.nx, asked.ny] {
        1.0
    } else {
        operations(asked) / operations(measured)
    };
    doctor::seconds_of_pair(&mut half_space) * ratio
}

/// Prints what a scene is expected to cost here.
pub fn write_expected(out: &mut Results, plan: &Plan) {
    let cost = &plan.cost;
    let mut line = |name: &str, text: String| writeln!(out, "    {name:<13} {text}");
    let cached = cost.memory_cached.map_or_else(String::new, |cached| {
        format!("; {} with the structure in the cache", megabytes(cached))
    });
    line("memory", format!("{}{cached}", megabytes(cost.memory)));
    if cost.unknowns > 0 {
        let unknowns = cost.unknowns;
        line(
            "unknowns",
            format!("{unknowns} of the harmonic balance at most"),
        );
    }
    if cost.iterations > 0.0 {
        let [least, most] = cost.iterations_range;
        line(
            "iterations",
            format!(
                "about {:.0} ({least:.0} to {most:.0}); decided step by step, by the error of each",
                cost.iterations
            ),
        );
    }
    line("disk", megabytes(cost.disk));
    if cost.fft_pairs > 0.0 {
        let [least, most] = cost.fft_pairs_range;
        line(
            "FFT pairs",
            format!("about {:.0} ({least:.0} to {most:.0})", cost.fft_pairs),
        );
    }
    let seconds = cost.seconds(rates(plan));
    let parts = [
        ("structure, unless it is in the cache", seconds.structure),
        ("contact and wear", seconds.contact),
        ("vibration", seconds.response),
        ("writing", seconds.writing),
    ];
    let parts: Vec<String> = parts
        .iter()
        .filter(|(_, s)| *s >= 0.05)
        .map(|(name, s)| format!("{name} {s:.1} s"))
        .collect();
    let parts = if parts.len() > 1 {
        format!(" ({})", parts.join(", "))
    } else {
        String::new()
    };
    line(
        "time",
        format!("about {:.1} s here, one thread{parts}", seconds.total()),
    );
}

/// What a finished run was expected to cost, and what it did, as one line.
pub fn compared_in_words(plan: &Plan, spent: &Spent) -> String {
    let cost = &plan.cost;
    let reduced = spent.seconds.contains_key(Stage::Structure.name());
    let mut parts = Vec::new();
    if cost.iterations > 0.0 {
        parts.push(format!(
            "{} iterations (expected {:.0})",
            spent.wear_iterations, cost.iterations
        ));
    }
    if cost.fft_pairs > 0.0 {
        parts.push(format!(
            "{:.0} FFT pairs ({:.0})",
            spent.total_pairs(),
            cost.fft_pairs
        ));
    }
    parts.push(format!(
        "{:.1} s ({:.1})",
        spent.total_seconds(),
        expected_seconds(plan, spent)
    ));
    parts.push(format!(
        "{} of disk ({})",
        megabytes(spent.disk),
        megabytes(cost.disk)
    ));
    if let Some(peak) = peak_memory() {
        let expected = match cost.memory_cached {
            Some(cached) if !reduced => cached,
            _ => cost.memory,
        };
        parts.push(format!(
            "{} of memory ({})",
            megabytes(peak),
            megabytes(expected)
        ));
    }
    format!("  {:<24} {}", "cost", parts.join(", "))
}

/// Seconds that the stages of a run are expected to take here.
fn expected_seconds(plan: &Plan, spent: &Spent) -> f64 {
    let reduced = spent.seconds.contains_key(Stage::Structure.name());
    plan.cost.seconds(rates(plan)).computing(reduced)
}

/// The same for programs: what a plan expects (the `cost` of `plan.json`) and what was spent, under the same names. Seconds are
/// expected of a machine at a moment: a finished run says the same each time it is asked.
pub fn compared(expected: &Value, spent: &Spent) -> Value {
    json!({
        "predicted": {
            "wear_iterations": expected["iterations"],
            "fft_pairs": expected["fft_pairs"],
            "fft_pairs_by_stage": expected["fft_pairs_by_stage"],
            "disk_bytes": expected["disk"],
            "memory_bytes": expected["memory"],
        },
        "actual": {
            "wear_iterations": spent.wear_iterations,
            "pruned_iterations": spent.pruned,
            "fft_pairs": spent.total_pairs(),
            "fft_pairs_by_stage": spent.fft_pairs,
            "disk_bytes": spent.disk,
            "seconds": spent.total_seconds(),
        },
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

/// High-water mark of this process's memory \[B\], where the system tells.
fn peak_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}
