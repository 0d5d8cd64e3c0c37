//! Tests of `inspect`: matrices of other programs, reported as text and as JSON.

use std::path::Path;

use crate::support::Bench;

fn sample(name: &str) -> String {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/structure/samples");
    samples.join(name).display().to_string()
}

/// Natural frequencies of the free sample \[Hz\], from scipy (`tests/structure/samples/expected.json`).
const FREE: [f64; 2] = [172.9669915618, 187.2808807192];
/// Lowest natural frequency of the sample with nodes 1 and 2 fixed \[Hz\], from scipy (`tests/structure/samples/expected.json`).
const CLAMPED: f64 = 139.8389250205;
const SAME: f64 = 1e-9;

fn assert_near(found: &serde_json::Value, right: f64) {
    let found = found.as_f64().expect("a number");
    assert!((found / right - 1.0).abs() < SAME, "{found} {right}");
}

#[test]
fn one_file_of_calculix_is_enough() {
    let bench = Bench::new();
    let found = bench
        .done(&["inspect", &sample("truss.sti"), "--json"])
        .json();
    assert_eq!((&found["dofs"], &found["nodes"]), (&15.into(), &5.into()));
    assert_eq!(
        (&found["rigid_modes"], &found["zero_mass_diagonals"]),
        (&6.into(), &3.into())
    );
    assert_eq!(found["is_stiffness_singular"], true);
    assert_eq!(found["stiffness"]["is_triangle"], true);
    assert_near(&found["stiffness"]["trace"], 3.8e7);
    for axis in ["x", "y", "z"] {
        assert_near(&found["mass_by_direction"][axis], 5.8);
    }
    for (mode, right) in FREE.into_iter().enumerate() {
        assert_near(&found["frequencies"][mode], right);
    }
    assert_eq!(found["frequencies"].as_array().map(Vec::len), Some(6));
    assert_eq!(found["damping"], serde_json::Value::Null);
}

#[test]
fn sets_and_nodes_are_held() {
    let bench = Bench::new();
    for held in ["clamp", "1-2", "1.123,2.123", "row:1-6"] {
        let arguments = [
            "inspect",
            &sample("truss.mas"),
            "--fixed",
            held,
            "--modes",
            "2",
            "--json",
        ];
        let found = bench.done(&arguments).json();
        assert_eq!(
            (&found["fixed"], &found["rigid_modes"]),
            (&6.into(), &1.into()),
            "{held}"
        );
        assert_near(&found["frequencies"][0], CLAMPED);
        assert_eq!(found["frequencies"].as_array().map(Vec::len), Some(2));
    }
    let did = bench.fretwear(&["inspect", &sample("truss.mas"), "--fixed", "NOSE"]);
    assert_eq!(did.code(), 2);
    assert!(did.stderr().contains("ALL, CLAMP, TIP"), "{}", did.stderr());
}

#[test]
fn a_person_reads_the_same() {
    let bench = Bench::new();
    let inputs = [
        format!("stiffness={}", sample("csr_K.npz")),
        format!("mass={}", sample("coo_M.npz")),
    ];
    let did = bench.done(&["inspect", &inputs[0], &inputs[1]]);
    for part in [
        "NPZ",
        "no file assigns them to nodes",
        "symmetric",
        "3.8000000000e7",
        "rigid modes",
        "172.966992 Hz",
        "singular",
    ] {
        assert!(did.stdout().contains(part), "no {part} in {}", did.stdout());
    }
}

#[test]
fn a_file_that_is_none_is_named_with_what_is_wrong() {
    let bench = Bench::new();
    bench.write(
        "cut.mtx",
        "%%MatrixMarket matrix coordinate real symmetric\n900000000000 900000000000 1\n1 1 2.0\n",
    );
    let did = bench.fretwear(&["inspect", "cut.mtx"]);
    assert_eq!((did.code(), did.stdout()), (2, String::new()));
    for part in ["cut.mtx", "line 2", "900000000000 rows"] {
        assert!(did.stderr().contains(part), "{}", did.stderr());
    }
    assert_eq!(bench.fretwear(&["inspect", "nowhere.mtx"]).code(), 2);
    assert_eq!(
        bench
            .fretwear(&["inspect", "cut.mtx", "--format", "vtk"])
            .code(),
        2
    );
}

#[test]
fn what_is_doubtful_is_warned_of() {
    let bench = Bench::new();
    bench.write(
        "K.mtx",
        "%%MatrixMarket matrix coordinate real general\n2 2 4\n1 1 4\n2 2 5\n1 2 -1\n2 1 -1.5\n",
    );
    let found = bench.done(&["inspect", "K.mtx", "--json"]).json();
    let warnings = found["warnings"].to_string();
    assert!(
        warnings.contains("stiffness is not symmetric") && warnings.contains("no mass"),
        "{warnings}"
    );
    assert_eq!(
        (
            &found["stiffness"]["is_symmetric"],
            &found["stiffness"]["asymmetry"]
        ),
        (&false.into(), &0.1.into())
    );
    assert_eq!(found["frequencies"], serde_json::Value::Null);
}

/// `inspect` distinguishes surface heights from matrices by the file name; for an NPY file, by the content.
#[test]
fn a_map_is_inspected_as_one() {
    let bench = crate::support::Bench::new();
    let mut text = "# Channel: Z\n# Width: 40 um\n# Height: 21 um\n# Value units: nm\n".to_owned();
    for j in 0..7 {
        let line: Vec<String> = (0..20)
            .map(|i| match (i, j) {
                (3, 4) => "***".to_owned(),
                _ => format!("{}", 5.0 * f64::from(i) + f64::from((i * 7 + j * 5) % 3)),
            })
            .collect();
        text += &(line.join(" ") + "\n");
    }
    bench.write("map.txt", text);
    let found = bench.done(&["inspect", "map.txt", "--json"]).json();
    assert_eq!(found["points"], serde_json::json!([20, 7]));
    assert_eq!(found["holes"], 1);
    assert_eq!(found["stated_unit"], 1e-9);
    let [x, y] = [0, 1].map(|axis| found["spacing"][axis].as_f64().expect("a spacing"));
    assert!((x / 2e-6 - 1.0).abs() < 1e-9 && (y / 3e-6 - 1.0).abs() < 1e-9);
    // The heights rise by 5 nm per point over 20 points.
    let rise = found["rise"][0].as_f64().expect("a rise");
    assert!((rise / 1e-7 - 1.0).abs() < 0.02, "{rise:e}");
    let said = bench.done(&["inspect", "map.txt"]).stdout();
    assert!(
        said.contains("nm, from the file") && said.contains("a line of the text is one y"),
        "{said}"
    );
    // Without a unit, `inspect` reports the heights as the numbers of the file.
    bench.write(
        "plain.csv",
        "0.5,1.5,2.5,9\n1.5,2.5,3.25,4.5\n0.5,1.5,0.5,0.5\n",
    );
    let said = bench.done(&["inspect", "plain.csv"]).stdout();
    assert!(said.contains("give surface.unit"), "{said}");
}
