//! Fretting wear of rough joints over millions of vibration cycles.
//!
//! The numerical modules do not depend on files, scenes or the terminal. The numerical modules are [`contact`],
//! [`dynamics`], [`model_update`], [`surface`], [`structure`], [`wear`] and [`mod@reference`]. [`scene`] is the input
//! of the user, [`tables`] and [`store`] define the files of a run, and [`stages`] connects them.
//!
//! # Notation
//!
//! All quantities are in SI units. The index `i` of a grid cell counts along x. The index `j` counts along y. Fields
//! are stored row by row, `c = i·ny + j`.
//!
//! | symbol | in the code | unit | meaning and sign | source |
//! |---|---|---|---|---|
//! | h | `heights` | m | composite height of the rough surface, positive towards the other body | \[A §2e\] |
//! | δ | `approach` | m | rigid approach of the bodies, positive when pressed together | \[A §2e\] |
//! | p | `pressure` | Pa | positive in compression; 0 to the cap | \[A eq. 2.3, 4.3\] |
//! | q | `shear` | Pa | shear traction, positive under a motion of the upper body along the axis; at most µp | \[A §2d\] |
//! | u | `displacement` | m | displacement of the upper body relative to the lower one, along x and y | \[A §2e\] |
//! | v | `slip`, `slip_path` | m | slip of a point, and the length of its path per cycle | \[A eq. 2.6\] |
//! | N, T | `normal_load`, `force` | N | resultants of p and q | \[A §2e\] |
//! | µ | `friction_coefficient` | 1 | Coulomb's friction coefficient | \[A §2c\] |
//! | α | `coefficient` | m³/J | worn volume per dissipated energy | \[A eq. 2.5\] |
//! | w | `wear`, `wear_depth` | m | cumulative worn depth, ≥ 0: worn height = h − w | \[A eq. 2.8\] |
//! | n | `cycles` | 1 | vibration cycles | \[A eq. 2.7\] |
//! | kn, kt | `kn`, `kt` | N/m | dN/dδ and dT/du of the joint or of a contact element, at fixed contact and stick areas | \[A §2e\] |
//! | N₀, g₀ | `normal_load`, `gap` | N, m | static load of a contact element, and its gap where it is open | \[A §2e\] |
//! | Q | `coefficients` | m | Fourier coefficients of displacements | \[A eq. 2.1–2.2\] |
//! | Rq, Sk, Ku | `rq`, `sk`, `ku` | m, 1, 1 | root mean square, skewness and kurtosis of heights | \[A eq. 4.1–4.2\] |
//! | E\*, G\*, β | `compliance`, [`contact::Pair`] | Pa, Pa, 1 | effective moduli of both half spaces, and Dundurs' parameter | |
//!
//! # Example: contact without a scene
//!
//! ```
//! use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
//! use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair};
//! use fretwear::grid::{Grid, Patch};
//!
//! // A sphere of 100 mm radius on a flat, both of steel, under 100 N.
//! let (radius, load) = (0.1, 100.0);
//! let patch = Patch::full(Grid::over([1.3e-3, 1.1e-3], [80, 72]));
//! let grid = patch.grid;
//! let height = |c| {
//!     let (i, j) = grid.cell(c);
//!     let (x, y) = grid.centre(i, j);
//!     -(x * x + y * y) / (2.0 * radius)
//! };
//! let heights: Vec<f64> = (0..grid.len()).map(height).collect();
//! let steel = Elastic { youngs_modulus: 198.4e9, poisson_ratio: 0.3 };
//! let mut half_space = HalfSpace::new(grid, Pair::same(steel), Boundary::Free);
//! let problem = NormalProblem::new(&patch, &heights, load);
//! let contact = normal::solve(&mut half_space, &problem, None, NormalOptions::default())?;
//!
//! // Hertz: p₀³ = 6 N E*² / (π³ R²).
//! let modulus = 198.4e9 / (2.0 * (1.0 - 0.3 * 0.3));
//! let hertz = (6.0 * load * f64::powi(modulus / radius, 2) / std::f64::consts::PI.powi(3)).cbrt();
//! let peak = contact.pressure.iter().copied().fold(0.0, f64::max);
//! assert!((peak / hertz - 1.0).abs() < 0.01);
//! # Ok::<(), fretwear::contact::ContactError>(())
//! ```

#![forbid(unsafe_code)]

/// Commit of the build, with `-dirty` if the sources were changed; `None` for a build outside of a checkout.
pub const COMMIT: Option<&str> = option_env!("FRETWEAR_COMMIT");

/// Version, with the commit in brackets if it is known.
pub const VERSION: &str = env!("FRETWEAR_VERSION");

pub mod campaign;
pub mod contact;
pub mod doctor;
pub mod dynamics;
pub mod fft;
mod files;
pub mod gauge;
pub mod grid;
pub mod journal;
pub mod json;
pub mod linalg;
pub mod material;
pub mod milestones;
pub mod model_update;
pub mod recipe;
pub mod reference;
pub mod rehearsal;
pub mod report;
pub mod scene;
pub mod stages;
pub mod store;
pub mod structure;
#[cfg(feature = "polars")]
pub mod study;
pub mod surface;
pub mod tables;
pub mod threads;
pub mod units;
pub mod vtu;
pub mod wear;
