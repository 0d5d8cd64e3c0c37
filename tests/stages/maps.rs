//! Runs with measured maps: matching maps, badly matching maps, and maps of both faces.

use fretwear::tables::TableName;

use crate::support::{Bench, Did, reader, summary, table};
use crate::surface::writers::{Sur, npy, sur};

/// Heights of a rough map without symmetry \[µm\].
fn heights(nx: usize, ny: usize) -> Vec<f64> {
    let wave = |i: usize, j: usize| {
        let (x, y) = (i as f64, j as f64);
        0.4 * (1.7 * x + 0.3 * y).sin() + 0.3 * (0.9 * y - 0.2 * x * x).cos()
    };
    (0..nx * ny).map(|k| wave(k / ny, k % ny)).collect()
}

fn map_of(nx: usize, ny: usize, heights: &[f64]) -> Vec<u8> {
    let data: Vec<u8> = heights.iter().flat_map(|h| h.to_le_bytes()).collect();
    npy("<f8", false, &format!("({nx}, {ny})"), &data)
}

fn scene(cells: [usize; 2], surface: &str) -> String {
    let [nx, ny] = cells;
    format!(
        "[joint]\nsize = [\"{} um\", \"{} um\"]\ngrid = [{nx}, {ny}]\n\
         [material]\nyoungs_modulus = \"210 GPa\"\npoisson_ratio = 0.3\n\
         [surface]\nkind = \"file\"\ndetrend = \"none\"\n{surface}\n[contact]\nnormal_load = \"0.1 N\"\n",
        10 * nx,
        8 * ny
    )
}

const SPACED: &str = "unit = \"um\"\nspacing = [\"10 um\", \"8 um\"]";

fn run(bench: &Bench, cells: [usize; 2], surface: &str) -> Did {
    bench.write("map.toml", scene(cells, surface));
    bench.fretwear(&["run", "map.toml", "--run", "run"])
}

fn of_surface(bench: &Bench, column: &str) -> Vec<f64> {
    let surface = reader(&bench.path("run")).read_once(TableName::Surface);
    let surface = surface.expect("readable").expect("there");
    surface.f64(column).expect("a column").to_vec()
}

#[test]
fn a_map_of_one_point_more_is_not_resampled() {
    let bench = Bench::new();
    let all = heights(20, 17);
    bench.write("map.npy", map_of(20, 17, &all));
    let did = run(&bench, [19, 16], &format!("path = \"map.npy\"\n{SPACED}"));
    assert_eq!(did.code(), 0, "{}", did.stderr());
    let said = did.stderr();
    assert!(
        said.contains("moved by 5.000e-6 x 4.000e-6 m") && !said.contains("resampled to"),
        "{said}"
    );
    let found = of_surface(&bench, "height");
    for (cell, height) in found.iter().enumerate() {
        let point = all[(cell / 16) * 17 + cell % 16];
        assert!((height - point * 1e-6).abs() < 1e-18, "{cell}");
    }
}

#[test]
fn what_does_not_fit_is_told_by_its_key() {
    let bench = Bench::new();
    let mut hollow = heights(20, 16);
    bench.write("map.npy", map_of(20, 16, &hollow));
    for (k, height) in hollow.iter_mut().enumerate() {
        if k % 20 > 2 {
            *height = f64::NAN;
        }
    }
    bench.write("hollow.npy", map_of(20, 16, &hollow));
    let map = "path = \"map.npy\"\nunit = \"um\"";
    for (surface, code, parts) in [
        (
            format!("{map}\nspacing = [\"100 um\", \"80 um\"]"),
            2,
            &[
                "2.000 x 1.600 points",
                "surface.spacing",
                "surface.correct.spacing",
            ][..],
        ),
        (
            format!("{map}\nspacing = [\"30 um\", \"24 um\"]"),
            0,
            &["6.667 × 5.333", "at least 16", "surface.spacing"],
        ),
        (
            format!("path = \"hollow.npy\"\n{SPACED}"),
            0,
            &[
                "share of the joint that was not measured is 0.85",
                "at most 0.3",
                "(85.00 %)",
            ],
        ),
        (
            "path = \"map.npy\"\nunit = \"mm\"\nspacing = [\"10 um\", \"8 um\"]".to_owned(),
            0,
            &[
                "surface.unit: the range of the heights of the map is",
                "surface.correct.unit",
            ],
        ),
    ] {
        bench.write("map.toml", scene([20, 16], &surface));
        let did = bench.fretwear(&["check", "map.toml"]);
        let said = did.stdout() + &did.stderr();
        assert_eq!(did.code(), code, "{surface}: {said}");
        let run = run(&bench, [20, 16], &surface);
        let all = said + &run.stderr();
        for part in parts {
            assert!(all.contains(part), "{surface}: {part} in {all}");
        }
        let _ = std::fs::remove_dir_all(bench.path("run"));
    }
}

/// The file declares millimetres, but its numbers are micrometres.
#[test]
fn a_correction_overrides_the_file_and_is_warned_of() {
    let bench = Bench::new();
    let points: Vec<i32> = heights(20, 16).iter().map(|h| (h * 1e3) as i32).collect();
    let about = Sur {
        bits: 32,
        nx: 20,
        ny: 16,
        lowest: -2000,
        holes: false,
        spacing: [1.0, 1.0],
        step: 1.0,
        offset: 0.0,
        units: [b"mm", b"mm", b"mm"],
        comment: b"",
    };
    bench.write("map.sur", sur(&about, &points));
    let correct =
        "path = \"map.sur\"\ncorrect = { unit = \"nm\", spacing = [\"10 um\", \"8 um\"] }";
    let did = run(&bench, [20, 16], correct);
    assert_eq!(did.code(), 0, "{}", did.stderr());
    let said = did.stderr();
    assert!(
        said.contains("surface.correct: heights in units of 1e-9 m, points 1e-5 x 8e-6 m apart"),
        "{said}"
    );
    let found = of_surface(&bench, "height");
    let range = found.iter().fold(0.0f64, |most, h| most.max(h.abs()));
    assert!(range > 1e-10 && range < 1e-5, "{range:e}");
    let both = format!("{correct}\nunit = \"um\"");
    let did = run(&bench, [20, 16], &both);
    assert_eq!(did.code(), 2);
    assert!(
        did.stderr().contains("give one or the other"),
        "{}",
        did.stderr()
    );
}

#[test]
fn two_faces_stay_with_their_run() {
    let bench = Bench::new();
    let (lower, upper) = (heights(20, 16), heights(24, 18));
    bench.write("lower.npy", map_of(20, 16, &lower));
    bench.write("upper.npy", map_of(24, 18, &upper));
    let surface = format!(
        "path = \"lower.npy\"\n{SPACED}\n\
         second = {{ path = \"upper.npy\", unit = \"um\", spacing = [\"10 um\", \"8 um\"], mirror = \"x\", shift = [\"20 um\", \"0 um\"] }}"
    );
    let did = run(&bench, [20, 16], &surface);
    assert_eq!(did.code(), 0, "{}", did.stderr());
    let [height, first, second] =
        ["height", "height_first", "height_second"].map(|column| of_surface(&bench, column));
    for cell in 0..20 * 16 {
        let (i, j) = (cell / 16, cell % 16);
        // The upper map has two more points at each end of x and one more at each end of y. It is shifted by two points and mirrored.
        let point = upper[(23 - i) * 18 + j + 1];
        assert!((second[cell] - point * 1e-6).abs() < 1e-18, "({i}, {j})");
        assert!((first[cell] - lower[cell] * 1e-6).abs() < 1e-18);
        assert!((height[cell] - first[cell] - second[cell]).abs() < 1e-18);
    }
    // Other heights of the second face belong to another run.
    let others: Vec<f64> = upper.iter().map(|h| 1.1 * h).collect();
    bench.write("upper.npy", map_of(24, 18, &others));
    let did = bench.fretwear(&["run", "map.toml", "--run", "run"]);
    assert_ne!(did.code(), 0, "{}", did.stderr());
    let missing = surface.replace("upper.npy", "nowhere.npy");
    let did = run(&bench, [20, 16], &missing);
    assert_eq!(did.code(), 2);
    assert!(
        did.stderr().contains("surface.second.path"),
        "{}",
        did.stderr()
    );
}

/// Sphere under 2 % of the sliding force. The energy by Mindlin is half of the energy on the grid.
#[test]
fn a_slip_ring_thinner_than_a_cell_is_in_the_error_of_the_cycle() {
    let bench = Bench::new();
    let text = "[joint]\nsize = [\"1 mm\", \"0.9 mm\"]\ngrid = [48, 44]\n\
        [material]\nyoungs_modulus = \"200 GPa\"\npoisson_ratio = 0.0\n\
        [surface]\nkind = \"sphere\"\nradius = \"25 mm\"\n\
        [contact]\nfriction_coefficient = 0.6\nnormal_load = \"90 N\"\ntransverse = \"absent\"\n\
        [motion]\nforce = \"1.08 N\"\n";
    bench.write("ring.toml", text);
    for (name, force, energy) in [("a", "1.08 N", 1.0242e-10), ("b", "2.7 N", 1.6335e-9)] {
        let set = format!("motion.force={force}");
        let did = bench.done(&["run", "ring.toml", "--run", name, "--set", &set]);
        assert!(did.stderr().contains("joint.grid: "), "{}", did.stderr());
        let root = bench.path(name);
        let cycle = table(&root, 0, TableName::FrettingCycle);
        let band = cycle.f64("slip_band").expect("a band")[0];
        let bar = summary(&root, 0, "error_cycle");
        let off = (summary(&root, 0, "dissipated_energy") / energy - 1.0).abs();
        assert!(
            band < 0.5 && bar >= 0.25 && off < bar,
            "{force}: {band}, {off} of {bar}"
        );
    }
}
