//! Tests read the files that `fretwear export RUN --vtu FOLDER` writes.

use std::fs;
use std::path::Path;

use fretwear::tables::TableName;
use quick_xml::events::Event;
use vtkio::model::{Attribute, DataSet, Piece, UnstructuredGridPiece, Vtk};

use crate::support::{Bench, latest, summary, table};

fn read(path: &Path) -> UnstructuredGridPiece {
    let vtk = Vtk::import(path).expect("a file of VTK");
    let DataSet::UnstructuredGrid { pieces, .. } = vtk.data else {
        panic!("{}: no unstructured grid", path.display())
    };
    match pieces.into_iter().next() {
        Some(Piece::Inline(piece)) => *piece,
        other => panic!("{other:?}"),
    }
}

fn values(attributes: &[Attribute], wanted: &str) -> Vec<f64> {
    let found = attributes.iter().find_map(|attribute| match attribute {
        Attribute::DataArray(array) if array.name == wanted => Some(array),
        _ => None,
    });
    let found = found.unwrap_or_else(|| panic!("no {wanted}"));
    found.data.cast_into::<f64>().expect("numbers")
}

fn attribute(series: &Path, name: &str) -> Vec<String> {
    let text = fs::read_to_string(series).expect("a series");
    let mut reader = quick_xml::Reader::from_str(&text);
    let mut found = Vec::new();
    loop {
        match reader.read_event().expect("XML") {
            Event::Empty(tag) => found.extend(
                tag.attributes()
                    .map(|a| a.expect("an attribute"))
                    .filter(|a| a.key.as_ref() == name)
                    .map(|a| a.value.into_owned()),
            ),
            Event::Eof => return found,
            _ => (),
        }
    }
}

#[test]
fn cells_are_where_they_are_and_carry_their_figures() {
    let bench = Bench::new();
    let short = ["--set", "wear.cycles=200_000", "--quiet"];
    bench.done(&[&["run", "small.toml", "--run", "a"], &short[..]].concat());
    bench.done(&["export", "a", "--vtu", "all"]);
    let root = bench.path("a");
    let files = attribute(&bench.path("all/joint.pvd"), "file");
    assert_eq!(files.len() as u64, latest(&root) + 1);
    let times = attribute(&bench.path("all/joint.pvd"), "timestep");
    for (k, (file, time)) in files.iter().zip(times).enumerate() {
        let cycles = summary(&root, k as u64, "cycles");
        assert_eq!(time.parse::<f64>().expect("a time"), cycles);
        let grid = read(&bench.path("all").join(file));
        let fields = table(&root, k as u64, TableName::ContactField);
        let worn = table(&root, k as u64, TableName::WearField);
        for (table, name) in [
            (&fields, "pressure"),
            (&fields, "gap"),
            (&worn, "wear_depth"),
        ] {
            let found = values(&grid.data.cell, name);
            assert_eq!(found, table.f64(name).expect("a column"), "{name} of {k}");
        }
        // The grid has 26 x 22 cells, and its centre is the origin; the joint measures 4 mm x 3 mm.
        let (i, j) = (fields.i32("i").expect("i"), fields.i32("j").expect("j"));
        let points: Vec<f64> = grid.points.cast_into().expect("numbers");
        let (corners, offsets) = grid.cells.cell_verts.into_xml();
        assert_eq!(offsets.len(), 26 * 22);
        for cell in [0, 100, 26 * 22 - 1] {
            let around = &corners[4 * cell..4 * cell + 4];
            let middle = [0, 1, 2].map(|d| {
                let sum: f64 = around.iter().map(|&p| points[3 * p as usize + d]).sum();
                sum / 4.0
            });
            let at =
                |k: i32, cells: f64, side: f64| (f64::from(k) + 0.5) / cells * side - side / 2.0;
            let expected = [at(i[cell], 26.0, 4e-3), at(j[cell], 22.0, 3e-3), 0.0];
            for (found, expected) in middle.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-15, "cell {cell}: {middle:?}");
            }
        }
    }
    assert!(!bench.path("all/elements.pvd").exists(), "no elements");
    // `RUN@1` exports only iteration 1.
    bench.done(&["export", "a@1", "--vtu", "one"]);
    assert_eq!(
        attribute(&bench.path("one/joint.pvd"), "file"),
        ["joint_00001.vtu"]
    );
    assert_eq!(
        fs::read_dir(bench.path("one")).expect("a folder").count(),
        2
    );
}

#[test]
fn what_is_no_run_is_refused() {
    let bench = Bench::new();
    for (arguments, said) in [
        (vec!["export", "small.toml", "--vtu", "x"], "run"),
        (vec!["export", "nowhere", "--vtu", "x"], "nowhere"),
        (vec!["export", "a@", "--vtu", "x"], "is not an iteration"),
        (vec!["export", "a@-1", "--vtu", "x"], "is not an iteration"),
        (vec!["export", "--vtu", "x"], "SCENE|RUN"),
        (
            vec!["export", "nowhere", "--vtu", "x", "--matrices", "y"],
            "--matrices",
        ),
    ] {
        let did = bench.fretwear(&arguments);
        assert_eq!(did.code(), 2, "{arguments:?}: {}", did.stderr());
        assert!(
            did.stderr().contains(said),
            "{arguments:?}: {}",
            did.stderr()
        );
        assert!(!bench.path("x").exists(), "{arguments:?}");
    }
}
