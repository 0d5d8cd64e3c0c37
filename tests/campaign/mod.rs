//! Campaigns: what a file means, what becomes of its rows, and what their runs say together.

mod collected;
mod definition;
#[cfg(unix)]
mod foreign;
mod guards;
mod lifetimes;
#[cfg(feature = "polars")]
mod report;
mod rows;
mod statistics;

use crate::support::Bench;

/// A folder with a scene of so few cells that its run takes some hundredths of a second, and a campaign file.
pub fn bench(campaign: &str) -> Bench {
    let bench = Bench::new();
    bench.write(
        "case.toml",
        format!("scene = \"small.toml\"\n[set]\nwear.cycles = 200_000\njoint.grid = [16, 12]\nsurface.correlation_length = [\"0.8 mm\", \"0.7 mm\"]\n{campaign}"),
    );
    bench
}

/// Two frictions with three surfaces.
pub const GRID: &str =
    "[grid]\ncontact.friction_coefficient = [0.5, 0.7]\nsurface.seed = { from = 1, to = 3 }\n";

/// Plans the case.
pub const PLAN: [&str; 6] = [
    "campaign",
    "plan",
    "case.toml",
    "--dir",
    "c",
    "--no-rehearsal",
];

/// Plans the case into the folder `c`.
pub fn planned(campaign: &str) -> Bench {
    let bench = bench(campaign);
    bench.done(&PLAN);
    bench
}
