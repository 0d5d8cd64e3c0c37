//! Tests of campaigns: the meaning of a campaign file, the states of its rows, and the results of its runs together.

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

/// Folder with a campaign file and a scene of few cells, whose run takes a few hundredths of a second.
pub fn bench(campaign: &str) -> Bench {
    let bench = Bench::new();
    bench.write(
        "case.toml",
        format!("scene = \"small.toml\"\n[set]\nwear.cycles = 200_000\njoint.grid = [16, 12]\nsurface.correlation_length = [\"0.8 mm\", \"0.7 mm\"]\n{campaign}"),
    );
    bench
}

/// Two friction coefficients with three surfaces.
pub const GRID: &str =
    "[grid]\ncontact.friction_coefficient = [0.5, 0.7]\nsurface.seed = { from = 1, to = 3 }\n";

/// Command that plans the case.
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
