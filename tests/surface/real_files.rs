//! Files from instruments. The environment variable names their folder.

use std::path::PathBuf;

use fretwear::grid::{Grid, Patch};
use fretwear::surface::prepare::{Detrend, Fill, PrepareOptions, onto_joint};
use fretwear::surface::readers::{ReadOptions, read};
use fretwear::surface::statistics::{Roughness, roughness};
use fretwear::surface::topography::Topography;

const FOLDER: &str = "FRETWEAR_REAL_DATA";

fn real(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os(FOLDER).map(|folder| PathBuf::from(folder).join(name));
    if path.is_none() {
        println!("skipped: {FOLDER} does not name a folder with {name}");
    }
    path
}

/// Statistics over the whole map after subtraction of the mean plane.
fn levelled(map: &Topography) -> Roughness {
    let patch = Patch::full(Grid::over(map.size().unwrap(), [map.nx, map.ny]));
    let options = PrepareOptions {
        detrend: Detrend::Plane,
        fill: Fill::Mask,
        shift: [0.0; 2],
    };
    let prepared = onto_joint(map, &patch, options).unwrap();
    roughness(&prepared.patch, &prepared.heights).unwrap()
}

/// Relative tolerance of the statistics below. An independent least-squares fit in double precision gave the values with at least six
/// digits.
const SAME: f64 = 2e-6;

fn assert_near(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < SAME, "{found} {expected}");
}

#[test]
fn a_digital_surf_map() {
    let Some(path) = real("surfaces/ST_sur-2.sur") else {
        return;
    };
    let mut map = read(&path, &ReadOptions::default()).unwrap().topography;
    assert_eq!((map.nx, map.ny), (563, 484));
    let size = map.size().unwrap();
    assert!(
        (size[0] - 1.9615e-3).abs() < 1e-7 && (size[1] - 1.6863e-3).abs() < 1e-7,
        "{size:?}"
    );
    // The file marks points without a measurement by a value two steps below its lowest point.
    assert_eq!(map.holes(), 117);
    let measured = levelled(&map);
    assert_near(measured.rq, 1.710413924e-8);
    assert_near(measured.sk, -15.642390);
    assert_near(measured.ku, 811.279029);
    // The figures published with the file (Rq 31 nm, Sk -30, Ku 1193) count these marks as heights.
    let lowest = map.heights.iter().copied().fold(f64::INFINITY, f64::min);
    let step = f64::from(1e-7f32) * 1e-3;
    for height in map.heights.iter_mut().filter(|h| h.is_nan()) {
        *height = lowest - 2.0 * step;
    }
    let published = levelled(&map);
    assert_near(published.rq, 3.086925315e-8);
    assert_near(published.sk, -30.442767);
    assert_near(published.ku, 1192.621342);
}

#[test]
fn an_x3p_map_with_unequal_spacings() {
    let Some(path) = real("surfaces/ST_x3p-2.x3p") else {
        return;
    };
    let map = read(&path, &ReadOptions::default()).unwrap().topography;
    assert_eq!((map.nx, map.ny, map.holes()), (650, 650, 0));
    let size = map.size().unwrap();
    assert!(
        (size[0] - 82.977e-6).abs() < 1e-9 && (size[1] - 204.478e-6).abs() < 1e-9,
        "{size:?}"
    );
    let found = levelled(&map);
    assert_near(found.rq, 7.719303279e-8);
    assert_near(found.sk, -0.378674);
    assert_near(found.ku, 2.984597);
}

#[test]
fn an_alicona_map() {
    let Some(path) = real("surfaces/ST_al3d-1.al3d") else {
        return;
    };
    let map = read(&path, &ReadOptions::default()).unwrap().topography;
    assert_eq!((map.nx, map.ny, map.holes()), (200, 296, 0));
    let size = map.size().unwrap();
    assert!(
        (size[0] - 87.605e-6).abs() < 1e-9 && (size[1] - 129.656e-6).abs() < 1e-9,
        "{size:?}"
    );
    let found = levelled(&map);
    assert_near(found.rq, 2.898221027836e-7);
    // The skewness is close to 0, so the test compares its absolute value.
    assert!((found.sk + 0.0049765253706697).abs() < SAME, "{}", found.sk);
    assert_near(found.ku, 3.0712779005932);
}

#[test]
fn the_softgauge_of_the_sdf_standard() {
    let Some(path) = real("surfaces/ST_sdf-1.sdf") else {
        return;
    };
    let map = read(&path, &ReadOptions::default()).unwrap().topography;
    assert_eq!((map.nx, map.ny, map.holes()), (7, 4, 0));
    assert_eq!(map.spacing, Some([1e-6, 1e-6]));
    // The last value of the second line and the first value of the last line, as in the file.
    assert_eq!(map.heights[6 * 4 + 1], 0.99874 * 1e-6);
    assert_eq!(map.heights[3], 0.97986 * 1e-6);
    let found = map.roughness().unwrap();
    assert_near(found.mean, 9.835632142857e-7);
    assert_near(found.rq, 1.360289728949e-8);
}
