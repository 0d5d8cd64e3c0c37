//! Changes of units, material or axes do not change the result: it stays the same within the error bar over many decades.
//! The program may also reject the scene with a reason.

use std::fmt::Write;

use fretwear::scene;
use fretwear::tables::typed;

use super::Start;
use crate::support::{Bench, latest, reader, summary};

/// Powers of ten as scale factors of a scene.
const DECADES: std::ops::RangeInclusive<i32> = -10..=10;
/// Smallest number of computed scales: joints from 1 µm to kilometres, and moduli from gels to more than diamond.
const COMPUTED: usize = 9;
/// Rounding, amplified by solvers that stop at a tolerance.
const SAME: f64 = 1e-6;

/// Surface from a file under an orbit, or under a straight motion with a varying load.
struct Case {
    grid: [usize; 2],
    /// Lines of x, values along y [µm].
    heights: Vec<Vec<f64>>,
    size: [f64; 2],
    amplitude: [f64; 2],
    phase: [f64; 2],
    load_amplitude: f64,
    scale: f64,
    modulus: f64,
}

impl Case {
    fn new(load_amplitude: f64) -> Case {
        let grid = [18, 22];
        let waves = [
            (2.0, 1.0, 0.4),
            (1.0, -3.0, 2.0),
            (4.0, 2.0, 5.0),
            (-3.0, 4.0, 1.0),
        ];
        let height = |i: usize, j: usize| -> f64 {
            let angle = |(m, n, phase): (f64, f64, f64)| {
                let [x, y] = [i as f64 / grid[0] as f64, j as f64 / grid[1] as f64];
                std::f64::consts::TAU * (m * x + n * y) + phase
            };
            waves.iter().map(|wave| angle(*wave).cos()).sum()
        };
        Case {
            grid,
            heights: (0..grid[0])
                .map(|i| (0..grid[1]).map(|j| height(i, j)).collect())
                .collect(),
            size: [2e-3, 1.6e-3],
            amplitude: [0.9e-6, 0.5e-6],
            phase: [0.0, 80.0],
            load_amplitude,
            scale: 1.0,
            modulus: 1.0,
        }
    }

    /// Exchanges x and y.
    fn swapped(mut self) -> Case {
        self.heights = (0..self.grid[1])
            .map(|j| self.heights.iter().map(|line| line[j]).collect())
            .collect();
        self.grid.swap(0, 1);
        self.size.swap(0, 1);
        self.amplitude.swap(0, 1);
        self.phase.swap(0, 1);
        self
    }

    /// Reverses the sign of x.
    fn mirrored(mut self) -> Case {
        self.heights.reverse();
        self.phase[0] += 180.0;
        self
    }

    fn text(&self, heights: &str) -> String {
        let Case {
            scale: s,
            modulus: k,
            ..
        } = *self;
        let load = 120.0 * s * s * k;
        let [nx, ny] = self.grid;
        let pair =
            |of: [f64; 2], unit: &str| format!("[\"{:e} {unit}\", \"{:e} {unit}\"]", of[0], of[1]);
        let [size, amplitude] = [self.size, self.amplitude].map(|of| pair(of.map(|v| v * s), "m"));
        let spacing = pair(
            [self.size[0] * s / nx as f64, self.size[1] * s / ny as f64],
            "m",
        );
        format!(
            "title = \"Invariant\"\n[joint]\nsize = {size}\ngrid = [{nx}, {ny}]\n\
             [material]\nyoungs_modulus = \"{:e} Pa\"\npoisson_ratio = 0.3\n\
             [surface]\nkind = \"file\"\npath = \"{heights}\"\nunit = \"m\"\nspacing = {spacing}\ndetrend = \"none\"\n\
             [contact]\nfriction_coefficient = 0.6\nnormal_load = \"{load:e} N\"\n\
             [motion]\namplitude = {amplitude}\nphase = {}\nnormal_load_amplitude = \"{:e} N\"\n\
             [wear]\ncoefficient = \"{:e} m^3/J\"\ncycles = 400_000\n",
            200e9 * k,
            pair(self.phase, "deg"),
            self.load_amplitude * load,
            2e-15 / k,
        )
    }

    /// Worn volume relative to the cube of the scale, its error bar, and wear depths relative to the scale; or the reason of a rejection.
    fn worn(&self, bench: &Bench, name: &str) -> Result<(f64, f64, Vec<Vec<f64>>), String> {
        let mut text = String::new();
        for line in &self.heights {
            let line: Vec<String> = line
                .iter()
                .map(|h| format!("{:e}", h * 0.5e-6 * self.scale))
                .collect();
            writeln!(text, "{}", line.join(" ")).expect("a text takes all");
        }
        let heights = format!("{name}.txt");
        bench.write(&heights, text);
        let path = bench.write(&format!("{name}.toml"), self.text(&heights));
        let scene = scene::load(&path, &[]).map_err(|error| error.to_string())?;
        let root = bench.path(name);
        let (ended, _) = Start::new(scene, &root).run();
        ended.map_err(|error| error.to_string())?;
        let end = latest(&root);
        let [volume, bar] = ["wear_volume", "error_wear_volume"].map(|of| summary(&root, end, of));
        let field: typed::WearField = reader(&root).typed(end).expect("a wear field");
        let mut depths = vec![vec![0.0; self.grid[1]]; self.grid[0]];
        for ((i, j), depth) in field.i.iter().zip(&field.j).zip(&field.wear_depth) {
            depths[*i as usize][*j as usize] = depth / self.scale;
        }
        Ok((volume / self.scale.powi(3), bar, depths))
    }
}

/// Constant load and varying load.
const LOAD_AMPLITUDES: [f64; 2] = [0.0, 0.3];

/// Compares the scaled case with the unscaled case at each `stride`-th decade.
fn over_decades(stride: usize, scaled: impl Fn(f64, Case) -> Case, refused_for: &[&str]) {
    let bench = Bench::new();
    for load_amplitude in LOAD_AMPLITUDES {
        let of = |case: Case, name: &str| case.worn(&bench, &format!("{name}-{load_amplitude}"));
        let (volume, bar, _) = of(Case::new(load_amplitude), "one").expect("worn");
        assert!(volume > 0.0 && bar < 0.2, "{volume:e} m3, bar {bar:e}");
        let mut computed = 0;
        for decade in DECADES.step_by(stride) {
            let case = scaled(10.0f64.powi(decade), Case::new(load_amplitude));
            match of(case, &format!("decade{decade}")) {
                Ok((scaled, _, _)) => {
                    computed += 1;
                    let off = (scaled / volume - 1.0).abs();
                    assert!(
                        off < SAME + 0.1 * bar,
                        "1e{decade}: off by {off:e}, bar {bar:e}"
                    );
                }
                Err(reason) => assert!(
                    refused_for.iter().any(|key| reason.contains(key)),
                    "1e{decade}: {reason}"
                ),
            }
        }
        assert!(computed >= COMPUTED / stride, "only {computed} decades");
    }
}

fn of_any_length(stride: usize) {
    let scaled = |scale, case| Case { scale, ..case };
    over_decades(
        stride,
        scaled,
        &["joint.size", "surface.", "motion.", "contact.", "spacing"],
    );
}

fn of_any_modulus(stride: usize) {
    let scaled = |modulus, case| Case { modulus, ..case };
    over_decades(
        stride,
        scaled,
        &[
            "material.youngs_modulus",
            "contact.normal_load",
            "wear.coefficient",
        ],
    );
}

#[test]
fn a_joint_of_any_length_wears_in_proportion() {
    of_any_length(7);
}

#[test]
fn a_joint_of_any_modulus_wears_alike() {
    of_any_modulus(7);
}

#[test]
#[ignore = "long: a minute"]
fn a_joint_wears_alike_over_all_decades() {
    of_any_length(1);
    of_any_modulus(1);
}

#[test]
fn a_joint_wears_alike_however_its_axes_lie() {
    let bench = Bench::new();
    for load_amplitude in LOAD_AMPLITUDES {
        let case = || Case::new(load_amplitude);
        let of = |case: Case, name: &str| {
            let worn = case.worn(&bench, &format!("{name}-{load_amplitude}"));
            worn.unwrap_or_else(|error| panic!("{name}: {error}"))
        };
        let (volume, _, depths) = of(case(), "as-it-is");
        let deepest = depths.iter().flatten().copied().fold(0.0, f64::max);
        let [nx, ny] = case().grid;
        // Place of a cell of the turned joint in the unturned joint.
        type Place = fn(usize, usize, [usize; 2]) -> (usize, usize);
        let turned: [(&str, Case, Place); 4] = [
            ("mirrored", case().mirrored(), |i, j, [nx, _]| {
                (nx - 1 - i, j)
            }),
            ("swapped", case().swapped(), |i, j, _| (j, i)),
            ("turned", case().swapped().mirrored(), |i, j, [_, ny]| {
                (j, ny - 1 - i)
            }),
            (
                "upside-down",
                case().mirrored().swapped().mirrored().swapped(),
                |i, j, [nx, ny]| (nx - 1 - i, ny - 1 - j),
            ),
        ];
        for (name, case, place) in turned {
            let (of_turned, _, worn) = of(case, name);
            let off = (of_turned / volume - 1.0).abs();
            assert!(off < ALIKE, "{name}: volume off by {off:e}");
            for (i, line) in worn.iter().enumerate() {
                for (j, depth) in line.iter().enumerate() {
                    let (i, j) = place(i, j, [nx, ny]);
                    let off = (depth - depths[i][j]).abs() / deepest;
                    assert!(off < ALIKE_IN_DEPTH, "{name} at {i}, {j}: off by {off:e}");
                }
            }
        }
    }
}

/// Effect of another order of sums, amplified by solvers that stop at a tolerance of `balanced`.
const ALIKE: f64 = 3e-4;
/// Effect of another order of sums on a single depth, relative to the largest depth.
const ALIKE_IN_DEPTH: f64 = 3e-3;
