use fretwear::grid::{Grid, Patch};
use fretwear::surface::prepare::{
    Detrend, Fill, Notice, PrepareError, PrepareOptions, PreparedSurface, onto_joint,
};
use fretwear::surface::statistics::roughness;
use fretwear::surface::topography::Topography;

use super::{bored, difference, field, joint};

/// Rounding of a least-squares fit over a thousand points, relative to the heights.
const ROUNDING: f64 = 1e-12;

const fn options(detrend: Detrend, fill: Fill) -> PrepareOptions {
    PrepareOptions {
        detrend,
        fill,
        shift: [0.0; 2],
    }
}

const AS_IT_IS: PrepareOptions = options(Detrend::None, Fill::Mask);

fn map(grid: &Grid, heights: Vec<f64>) -> Topography {
    Topography {
        nx: grid.nx,
        ny: grid.ny,
        spacing: Some([grid.dx, grid.dy]),
        heights,
    }
}

/// Roughness of micrometres over a joint of millimetres.
fn rough(x: f64, y: f64) -> f64 {
    1e-6 * ((x * 2.9e3).sin() + (y * 4.1e3 + 1.0).cos() * (x * 1.3e3).cos())
}

#[test]
fn a_map_of_the_same_shape_is_used_as_it_is() {
    let patch = bored([40, 30]);
    let heights = field(&patch.grid, |x, y| 3e-6 + rough(x, y));
    for spacing in [Some([patch.grid.dx, patch.grid.dy]), None] {
        let map = Topography {
            spacing,
            ..map(&patch.grid, heights.clone())
        };
        let found = onto_joint(&map, &patch, AS_IT_IS).unwrap();
        assert_eq!(found.notices, []);
        assert_eq!(found.patch, patch);
        for ((h, expected), kept) in found.heights.iter().zip(&heights).zip(&patch.is_in_joint) {
            assert_eq!(*h, if *kept { *expected } else { 0.0 }, "bit by bit");
        }
    }
}

#[test]
fn trends_are_removed_exactly_and_leave_the_rest() {
    let patch = bored([40, 30]);
    let plane = |x: f64, y: f64| 2e-4 + 3e-2 * x - 1e-2 * y;
    let form = move |x: f64, y: f64| plane(x, y) + 4.0 * x * x - 2.0 * x * y + 3.0 * y * y;
    let largest = 3e-4;
    let after = |height: &dyn Fn(f64, f64) -> f64, trend| {
        let heights = field(&patch.grid, height);
        onto_joint(
            &map(&patch.grid, heights),
            &patch,
            options(trend, Fill::Mask),
        )
        .unwrap()
        .heights
    };
    let zero = vec![0.0; patch.grid.len()];
    assert!(difference(&after(&plane, Detrend::Plane), &zero) < ROUNDING * largest);
    assert!(difference(&after(&plane, Detrend::Quadratic), &zero) < ROUNDING * largest);
    assert!(difference(&after(&form, Detrend::Quadratic), &zero) < ROUNDING * largest);
    assert!(
        difference(&after(&form, Detrend::Plane), &zero) > 1e-6,
        "a plane does not remove a quadratic trend"
    );

    // The detrended roughness does not depend on the trend.
    let both = after(&|x, y| form(x, y) + rough(x, y), Detrend::Quadratic);
    let alone = after(&rough, Detrend::Quadratic);
    assert!(difference(&both, &alone) < ROUNDING * largest);
    // The detrended heights are orthogonal to x over the kept cells.
    let level = after(&rough, Detrend::Plane);
    let moment: f64 = level
        .iter()
        .zip(field(&patch.grid, |x, _| x))
        .map(|(h, x)| h * x)
        .sum();
    assert!(moment.abs() < ROUNDING * 1e-6 * 4e-3 * 1200.0);
    let mean = after(&|x, y| 1e-3 + rough(x, y), Detrend::Mean);
    assert!(roughness(&patch, &mean).unwrap().mean.abs() < ROUNDING * 1e-3);
}

#[test]
fn what_lies_in_the_bolt_hole_spoils_neither_trend_nor_rim() {
    // The instrument measures the bottom of the hole, 5 mm below the face. The map is finer than the joint.
    let patch = bored([32, 24]);
    let fine = joint([84, 66]);
    // The circle of the hole lies slightly inside the staircase of removed cells.
    let deep = |x: f64, y: f64| {
        if x.hypot(y) < 0.85e-3 {
            -5e-3
        } else {
            1e-2 * x + 2e-3 * y
        }
    };
    let found = onto_joint(
        &map(&fine, field(&fine, deep)),
        &patch,
        options(Detrend::Plane, Fill::Mask),
    )
    .unwrap();
    let zero = vec![0.0; patch.grid.len()];
    assert!(
        difference(&found.heights, &zero) < ROUNDING * 5e-3,
        "{}",
        difference(&found.heights, &zero)
    );
    assert_eq!(found.patch, patch);
}

/// Field with a round hole inside, a hole at the edge and a hole in a corner.
fn with_holes(grid: &Grid, height: impl Fn(f64, f64) -> f64) -> (Vec<f64>, usize) {
    let [lx, ly] = grid.size();
    let heights = field(grid, |x, y| {
        let inside = (x - 2e-3).hypot(y - 1e-3) < 0.7e-3;
        let edge = x > 0.5 * lx - 0.5e-3 && y.abs() < 0.6e-3;
        let corner = x < -0.5 * lx + 0.9e-3 && y < -0.5 * ly + 0.8e-3;
        if inside || edge || corner {
            f64::NAN
        } else {
            height(x, y)
        }
    });
    let holes = heights.iter().filter(|h| h.is_nan()).count();
    assert!(holes > 20);
    (heights, holes)
}

#[test]
fn holes_are_filled_exactly_on_a_plane_and_smoothly_elsewhere() {
    let patch = Patch::full(joint([50, 36]));
    let plane = |x: f64, y: f64| 1e-4 + 2e-2 * x - 3e-2 * y;
    let (heights, holes) = with_holes(&patch.grid, plane);
    let found = onto_joint(
        &map(&patch.grid, heights),
        &patch,
        options(Detrend::None, Fill::Interpolate),
    )
    .unwrap();
    assert_eq!(
        found.notices,
        [Notice::Filled {
            share: holes as f64 / 1800.0,
            points: holes
        }]
    );
    assert!(difference(&found.heights, &field(&patch.grid, plane)) < 1e-11 * 1e-4);

    // The measured points do not change. Each filled point is the weighted mean of its neighbours, so the measured points bound its height.
    let (heights, _) = with_holes(&patch.grid, rough);
    let found = onto_joint(
        &map(&patch.grid, heights.clone()),
        &patch,
        options(Detrend::None, Fill::Interpolate),
    )
    .unwrap();
    let (wx, wy) = (patch.grid.dx.powi(-2), patch.grid.dy.powi(-2));
    let at = |i: usize, j: usize| found.heights[patch.grid.index(i, j)];
    for (index, h) in heights.iter().enumerate() {
        if !h.is_nan() {
            assert_eq!(found.heights[index], *h);
            continue;
        }
        let (i, j) = patch.grid.cell(index);
        if i > 0 && i < 49 && j > 0 && j < 35 {
            let mean = wx * (at(i - 1, j) + at(i + 1, j)) + wy * (at(i, j - 1) + at(i, j + 1));
            let error = mean / (2.0 * (wx + wy)) - at(i, j);
            assert!(error.abs() < 1e-11 * 2e-6, "({i}, {j}): {error:e}");
        }
    }
}

#[test]
fn holes_are_masked_out_of_the_joint() {
    let patch = bored([50, 36]);
    let (heights, _) = with_holes(&patch.grid, |x, y| 1e-3 + rough(x, y));
    let found = onto_joint(
        &map(&patch.grid, heights.clone()),
        &patch,
        options(Detrend::Mean, Fill::Mask),
    )
    .unwrap();
    for (index, h) in heights.iter().enumerate() {
        assert_eq!(
            found.patch.is_in_joint[index],
            patch.is_in_joint[index] && !h.is_nan()
        );
        assert!(found.patch.is_in_joint[index] || found.heights[index] == 0.0);
    }
    let cells = patch.cells() - found.patch.cells();
    let within = heights
        .iter()
        .zip(&patch.is_in_joint)
        .filter(|(h, k)| **k && h.is_nan())
        .count();
    assert_eq!(
        found.notices,
        [Notice::Masked {
            share: within as f64 / patch.cells() as f64,
            points: within,
            cells
        }]
    );
    assert!(roughness(&found.patch, &found.heights).unwrap().mean.abs() < ROUNDING * 1e-3);

    // On another grid, a cell remains if half of its area was measured. The hole does not change its height.
    let fine = joint([150, 108]);
    let plane = |x: f64, y: f64| 2e-2 * x - 3e-2 * y;
    let (heights, _) = with_holes(&fine, plane);
    let found = onto_joint(&map(&fine, heights), &patch, AS_IT_IS).unwrap();
    let lost = patch.cells() - found.patch.cells();
    assert!(lost.abs_diff(cells) < 15, "{lost} {cells}");
    for (index, expected) in field(&patch.grid, plane).iter().enumerate() {
        if found.patch.is_in_joint[index] {
            assert!((found.heights[index] - expected).abs() < 1e-10 * 1e-4);
        }
    }
    assert!(matches!(
        found.notices[..],
        [Notice::Resampled { .. }, Notice::Masked { .. }]
    ));
}

#[test]
fn sizes_that_differ_are_said_and_never_stretched() {
    let patch = Patch::full(joint([40, 30]));
    let of = |size: [f64; 2], cells: [usize; 2], centre: f64| {
        let grid = Grid::over(size, cells);
        // The heights encode the position, so the test would detect a stretch.
        onto_joint(
            &map(&grid, field(&grid, |x, y| 1e-3 * (x - centre) + 1e-4 * y)),
            &patch,
            AS_IT_IS,
        )
    };
    let expected = field(&patch.grid, |x, y| 1e-3 * x + 1e-4 * y);

    // The map is larger along both axes by a fractional number of points.
    let found = of([10.3e-3, 6.1e-3], [117, 83], 0.0).unwrap();
    assert!(matches!(
        found.notices[..],
        [
            Notice::Cropped { .. },
            Notice::Resampled { assumed: false, .. }
        ]
    ));
    assert!(difference(&found.heights, &expected) < ROUNDING * 1e-5);
    assert!(
        found.notices[0].to_string().contains("1.03"),
        "{}",
        found.notices[0]
    );
    // The map is larger only along x and has the shape of the joint. The program resamples the map.
    let found = of([9e-3, 5e-3], [40, 30], 0.0).unwrap();
    assert!(difference(&found.heights, &expected) < ROUNDING * 1e-5);

    let error = of([7.9e-3, 6e-3], [40, 30], 0.0).unwrap_err();
    assert!(matches!(error, PrepareError::Smaller { .. }));
    let message = error.to_string();
    assert!(
        message.contains("7.9") && message.contains("8.0") && message.contains("surface.spacing"),
        "{message}"
    );

    // Within 1 %, the program adjusts the spacing and reports the adjustment.
    let found = of([7.95e-3, 5.03e-3], [40, 30], 0.0).unwrap();
    assert!(matches!(found.notices[..], [Notice::Fitted { .. }]));
    // A difference by single-precision rounding needs no notice.
    let found = of([8e-3 * (1.0 + 5e-8), 5e-3], [40, 30], 0.0).unwrap();
    assert_eq!(found.notices, []);
}

#[test]
fn what_cannot_be_prepared() {
    let patch = bored([12, 10]);
    let good = field(&patch.grid, rough);
    // Two measured columns define a plane, but not a quadratic.
    let columns: Vec<f64> = (0..120)
        .map(|k| if k / 10 < 2 { good[k] } else { f64::NAN })
        .collect();
    let plane = onto_joint(
        &map(&patch.grid, columns.clone()),
        &patch,
        options(Detrend::Plane, Fill::Mask),
    )
    .unwrap();
    assert_eq!(plane.patch.cells(), 20);
    let error = onto_joint(
        &map(&patch.grid, columns),
        &patch,
        options(Detrend::Quadratic, Fill::Mask),
    );
    assert_eq!(
        error.unwrap_err(),
        PrepareError::Underdetermined {
            detrend: "quadratic",
            points: 20,
            terms: 6
        }
    );
    // Only the bolt hole has measurements.
    let inside: Vec<f64> = good
        .iter()
        .zip(&patch.is_in_joint)
        .map(|(h, k)| if *k { f64::NAN } else { *h })
        .collect();
    let error = onto_joint(&map(&patch.grid, inside), &patch, AS_IT_IS).unwrap_err();
    assert!(matches!(error, PrepareError::NothingMeasured { .. }));
    let mut infinite = good.clone();
    infinite[37] = f64::INFINITY;
    let error = onto_joint(&map(&patch.grid, infinite), &patch, AS_IT_IS).unwrap_err();
    assert!(matches!(error, PrepareError::Infinite { i: 3, j: 7, .. }));
    let short = map(&patch.grid, good[1..].to_vec());
    assert!(matches!(
        onto_joint(&short, &patch, AS_IT_IS),
        Err(PrepareError::Length { found: 119, .. })
    ));
}

/// Part of a map that the joint covers, and the cell shape of a map without a spacing.
#[test]
fn points_of_the_map_along_the_joint() {
    let patch = Patch::full(joint([12, 8]));
    let [lx, ly] = patch.grid.size();
    let on = |nx: usize, ny: usize, spacing| {
        let heights = vec![0.0; nx * ny];
        let map = Topography {
            nx,
            ny,
            spacing,
            heights,
        };
        onto_joint(&map, &patch, AS_IT_IS)
    };
    // Cropped only along x.
    let found = on(12, 8, Some([lx / 5.5, ly / 8.0])).unwrap().fit;
    assert!((found.points[0] - 5.5).abs() < ROUNDING, "{found:?}");
    assert_eq!((found.points[1], found.is_assumed), (8.0, false));
    // A crop to fewer than three points has no usable roughness.
    let few = on(12, 8, Some([lx / 2.5, ly / 8.0])).unwrap().fit;
    let refused = few.check().unwrap_err();
    let said = refused.to_string();
    assert!(
        said.contains("2.500 x 8.000") && said.contains("surface.spacing"),
        "{said}"
    );
    let found = on(6, 16, None).unwrap().fit;
    assert_eq!(found.points, [6.0, 16.0]);
    let aspect = (lx / 6.0) / (ly / 16.0);
    assert!((found.aspect / aspect - 1.0).abs() < ROUNDING && found.is_assumed);
    assert_eq!((found.correlation, found.range), ([None; 2], 0.0));
}

/// A map with the spacing of the cells and some additional points needs no resampling, for any parity.
#[test]
fn a_window_of_whole_points_is_taken() {
    let patch = Patch::full(joint([12, 8]));
    let [dx, dy] = [patch.grid.dx, patch.grid.dy];
    let of = |more: [usize; 2], off: f64, shift: [f64; 2]| {
        let (nx, ny) = (12 + more[0], 8 + more[1]);
        // The height encodes the index of the point.
        let map = Topography {
            nx,
            ny,
            spacing: Some([dx * (1.0 + off), dy]),
            heights: (0..nx * ny)
                .map(|k| (100 * (k / ny) + k % ny) as f64 * 1e-9)
                .collect(),
        };
        let options = PrepareOptions { shift, ..AS_IT_IS };
        onto_joint(&map, &patch, options)
    };
    let first = |found: &PreparedSurface| (found.heights[0] * 1e9).round() as usize;
    let moved = |found: &PreparedSurface| {
        found.notices.iter().find_map(|notice| match notice {
            Notice::Moved { offset } => Some(*offset),
            _ => None,
        })
    };
    let is_resampled = |found: &PreparedSurface| {
        let mut notices = found.notices.iter();
        notices.any(|notice| matches!(notice, Notice::Resampled { .. }))
    };
    let even = of([4, 2], 0.0, [0.0; 2]).unwrap();
    assert_eq!((first(&even), moved(&even)), (201, None));
    assert!(!is_resampled(&even));
    // Two windows are equally near to the middle. The program takes the lower window and moves the map up.
    let odd = of([3, 1], 0.0, [0.0; 2]).unwrap();
    assert_eq!(first(&odd), 100);
    let offset = moved(&odd).expect("a notice of the offset");
    assert!((offset[0] - 0.5 * dx).abs() < 1e-9 * dx && (offset[1] - 0.5 * dy).abs() < 1e-9 * dy);
    assert!(!is_resampled(&odd));
    // A spacing that differs by 1/1000 of a cell over the joint counts as equal. A difference of 1/10 does not.
    assert!(!is_resampled(&of([3, 1], 8e-5, [0.0; 2]).unwrap()));
    assert!(is_resampled(&of([3, 1], 8e-3, [0.0; 2]).unwrap()));
    // A shift by +x selects earlier points.
    let shifted = of([4, 2], 0.0, [2.0 * dx, -dy]).unwrap();
    assert_eq!((first(&shifted), moved(&shifted)), (2, None));
    let rounded = of([4, 2], 0.0, [0.8 * dx, 0.0]).unwrap();
    assert_eq!(first(&rounded), 101);
    let offset = moved(&rounded).expect("a notice of the offset");
    assert!((offset[0] - 0.2 * dx).abs() < 1e-9 * dx, "{offset:?}");
    let refused = of([4, 2], 0.0, [3.0 * dx, 0.0]).unwrap_err();
    assert!(matches!(refused, PrepareError::Uncovered { axis: 'x', .. }));
}

/// One asymmetric spike on each face. Only the expected cells have a height.
#[test]
fn two_faces_are_added_outwards() {
    let patch = Patch::full(joint([12, 8]));
    let [dx, dy] = [patch.grid.dx, patch.grid.dy];
    let spike = |nx: usize, ny: usize, at: [[usize; 2]; 2]| {
        let mut heights = vec![0.0; nx * ny];
        for ([i, j], height) in at.into_iter().zip([5e-6, 2e-6]) {
            heights[i * ny + j] = height;
        }
        let spacing = Some([dx, dy]);
        Topography {
            nx,
            ny,
            spacing,
            heights,
        }
    };
    let first = spike(12, 8, [[1, 6], [2, 6]]);
    let second = spike(16, 10, [[4, 2], [4, 3]]);
    let place = |map: &Topography, shift| {
        let options = PrepareOptions { shift, ..AS_IT_IS };
        onto_joint(map, &patch, options).unwrap()
    };
    let spikes = |found: &PreparedSurface| -> Vec<((usize, usize), f64)> {
        let cells = found.heights.iter().enumerate();
        cells
            .filter(|(_, h)| **h != 0.0)
            .map(|(cell, h)| (patch.grid.cell(cell), *h))
            .collect()
    };
    let both = |map: &Topography, shift| place(&first, [0.0; 2]).composite(place(map, shift));
    let own = [((1, 6), 5e-6), ((2, 6), 2e-6)];
    // The middle of the map lies on the middle of the joint. The crop removes two points along x and one point along y.
    let plain = both(&second, [0.0; 2]);
    assert_eq!(
        spikes(&plain),
        [own[0], ((2, 1), 5e-6), ((2, 2), 2e-6), own[1]]
    );
    // h(Lx - x, y): line 4 of 16 becomes line 11, which is line 9 of the joint.
    let mirrored = second.mirrored_along_x();
    let over_y = both(&mirrored, [0.0; 2]);
    assert_eq!(
        spikes(&over_y),
        [own[0], own[1], ((9, 1), 5e-6), ((9, 2), 2e-6)]
    );
    let moved = both(&mirrored, [dx, -dy]);
    assert_eq!(
        spikes(&moved),
        [own[0], own[1], ((10, 0), 5e-6), ((10, 1), 2e-6)]
    );
    // Both spikes of a line coincide: line 2 of 10 becomes line 7, which is line 6 of the joint.
    let over_x = both(&second.mirrored_along_y(), [0.0; 2]);
    assert_eq!(
        spikes(&over_x),
        [own[0], ((2, 5), 2e-6), ((2, 6), 2e-6 + 5e-6)]
    );
    let faces = moved.faces.expect("both faces");
    assert_eq!(faces[1][patch.grid.index(10, 0)], 5e-6);
    // A hole in one face is a hole in the sum.
    let mut holed = second.clone();
    holed.heights[5 * 10 + 4] = f64::NAN;
    let found = place(&first, [0.0; 2]).composite(place(&holed, [0.0; 2]));
    assert!(!found.patch.is_in_joint[patch.grid.index(3, 3)]);
    assert_eq!(found.patch.cells(), 12 * 8 - 1);
    assert!(found.notices[0].to_string().starts_with("second face: "));
}
