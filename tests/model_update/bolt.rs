use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::contact::{Pair, stiffness};
use fretwear::grid::{Grid, Patch};
use fretwear::model_update::{
    Bolt, BoltContact, ModelUpdateError, PRELOAD_TOLERANCE, Preload, preload,
};
use fretwear::reference::Hertz;

use super::{STEEL, assert_close, half_space};
use crate::contact::paraboloid;

/// Preload of the published case \[N\].
const LOAD: f64 = 30e3;

/// Largest number of contact solutions that Newton's method needs from the unworn preload.
const FEW: usize = 8;

fn solve(bolt: Bolt, worn: impl Fn(f64) -> BoltContact) -> Result<Preload, ModelUpdateError> {
    preload(bolt, None, |load| Ok(worn(load)))
}

/// Faces with a linear compliance that have come closer by `wear`.
#[test]
fn a_linear_contact_shares_the_wear_with_the_bolt() {
    let (k, kb) = (5e9, 4e8);
    for wear in [0.0, 1e-7, 5e-6, 60e-6] {
        let bolt = Bolt {
            stiffness: kb,
            load: LOAD,
            approach: LOAD / k,
        };
        let found = solve(bolt, |load| BoltContact {
            approach: load / k + wear,
            kn: k,
        })
        .expect("a preload");
        // Two springs in series, with their stretch reduced by the wear.
        let expected = LOAD - wear * k * kb / (k + kb);
        assert!((found.load - expected).abs() <= PRELOAD_TOLERANCE * LOAD);
        assert!(found.calls <= 2, "{} calls", found.calls);
        assert_eq!(found.approach, found.load / k + wear);
    }
}

/// A sphere, for which the wear that leads to a given preload is known.
fn sphere(load: f64) -> Hertz {
    Hertz {
        radius: 0.5,
        load,
        effective_modulus: Pair::same(STEEL).effective_modulus(),
    }
}

fn hertz(load: f64, wear: f64) -> BoltContact {
    BoltContact {
        approach: sphere(load).approach() + wear,
        kn: sphere(load).normal_stiffness(),
    }
}

#[test]
fn a_sphere_keeps_the_preload_that_its_wear_leaves() {
    for kb in [1e8, 1e9, 2e10] {
        let bolt = Bolt {
            stiffness: kb,
            load: LOAD,
            approach: sphere(LOAD).approach(),
        };
        for left in [0.999, 0.9, 0.5, 0.1, 0.01, 0.001] {
            let expected = left * LOAD;
            let wear = (LOAD - expected) / kb + bolt.approach - sphere(expected).approach();
            let found = solve(bolt, |load| hertz(load, wear)).expect("a preload");
            let miss = (found.load - expected).abs();
            assert!(
                miss <= 2.0 * PRELOAD_TOLERANCE * LOAD,
                "kb {kb:e}, {left}: {found:?}"
            );
            if left > 0.3 {
                assert!(found.calls <= FEW, "kb {kb:e}, {left}: {found:?}");
            }
            // A known preload as the start needs fewer contact solutions.
            let again = preload(bolt, Some(found.load), |load| {
                Ok::<_, ModelUpdateError>(hertz(load, wear))
            });
            assert_eq!(again.expect("a preload").calls, 1);
            // Without slopes, the search needs more contact solutions and finds the same preload.
            let halved = solve(bolt, |load| BoltContact {
                kn: 0.0,
                ..hertz(load, wear)
            });
            let miss = (halved.expect("a preload").load - expected).abs();
            assert!(miss <= 2.0 * PRELOAD_TOLERANCE * LOAD);
        }
    }
}

/// Within the tolerance of its solution, the worn contact may be slightly higher than the unworn contact.
#[test]
fn a_preload_above_the_unworn_one_is_found() {
    let bolt = Bolt {
        stiffness: 1e9,
        load: LOAD,
        approach: sphere(LOAD).approach(),
    };
    let found = solve(bolt, |load| hertz(load, -1e-6)).expect("a preload");
    assert!(found.load > LOAD);
    let balance = LOAD - 1e9 * (found.approach - bolt.approach) - found.load;
    assert!(balance.abs() < 2e-6 * LOAD, "{balance:e} N");
}

#[test]
fn a_joint_that_came_loose_says_by_how_much() {
    let bolt = Bolt {
        stiffness: 1e9,
        load: LOAD,
        approach: sphere(LOAD).approach(),
    };
    // The stretch of the bolt is 30 µm, the approach of the sphere is smaller.
    let wear = 30e-6 + bolt.approach + 1e-9;
    let found = solve(bolt, |load| {
        if load > 0.0 {
            hertz(load, wear)
        } else {
            BoltContact {
                approach: wear,
                kn: 0.0,
            }
        }
    })
    .expect_err("loose");
    let ModelUpdateError::Loose {
        load,
        bolt_stiffness,
        settlement,
        stretch,
    } = found
    else {
        panic!("{found}");
    };
    assert_eq!((load, bolt_stiffness, stretch), (LOAD, 1e9, 30e-6));
    assert_close(settlement, 30.001e-6, 1e-9, "settlement");
}

#[test]
fn a_bolt_that_is_none_is_refused() {
    let right = Bolt {
        stiffness: 1e9,
        load: LOAD,
        approach: 0.0,
    };
    for (wrong, key) in [
        (
            Bolt {
                stiffness: -1.0,
                ..right
            },
            "contact.bolt_stiffness",
        ),
        (
            Bolt {
                stiffness: f64::INFINITY,
                ..right
            },
            "contact.bolt_stiffness",
        ),
        (Bolt { load: 0.0, ..right }, "contact.normal_load"),
    ] {
        let found = solve(wrong, |load| hertz(load, 0.0));
        assert!(
            matches!(found, Err(ModelUpdateError::OutOfRange { name, .. }) if name == key),
            "{found:?}"
        );
    }
    let found = solve(right, |_| BoltContact {
        approach: f64::NAN,
        kn: 1.0,
    });
    assert!(matches!(found, Err(ModelUpdateError::OutOfRange { .. })));
}

#[test]
fn a_bolt_without_stiffness_keeps_its_load() {
    let bolt = Bolt {
        stiffness: 0.0,
        load: LOAD,
        approach: sphere(LOAD).approach(),
    };
    let found = solve(bolt, |load| hertz(load, 1e-3)).expect("a preload");
    assert_eq!((found.load, found.calls), (LOAD, 1));
}

/// Contact solutions of a worn paraboloid: the returned load satisfies the equilibrium.
#[test]
fn the_balance_holds_for_a_contact_that_is_solved() {
    let grid = Grid::over([4e-3, 3e-3], [50, 42]);
    let patch = Patch::full(grid);
    let height = paraboloid(grid, 0.05, (0.0, 0.0));
    let mut half_space = half_space(grid);
    let options = NormalOptions {
        tolerance: 1e-9,
        ..NormalOptions::default()
    };
    let mut contact = |height: &[f64], load: f64| -> Result<BoltContact, ModelUpdateError> {
        let problem = NormalProblem::new(&patch, height, load);
        let solution = normal::solve(&mut half_space, &problem, None, options).expect("contact");
        let set: Vec<bool> = solution.pressure.iter().map(|&p| p > 0.0).collect();
        let kn = stiffness::normal(&mut half_space, &set).expect("kn");
        Ok(BoltContact {
            approach: solution.approach,
            kn: kn.total,
        })
    };
    let load = 200.0;
    let bolt = Bolt {
        stiffness: 2e7,
        load,
        approach: contact(&height, load).expect("unworn").approach,
    };
    // The wear removes the cap of the paraboloid.
    let worn = |depth: f64| -> Vec<f64> { height.iter().map(|h| h.min(-depth)).collect() };
    let faces = worn(2e-6);
    let found = preload(bolt, None, |n| contact(&faces, n)).expect("a preload");
    assert!(found.load < load && found.load > 0.5 * load, "{found:?}");
    assert!(found.calls <= FEW, "{found:?}");
    let balance = load - bolt.stiffness * (found.approach - bolt.approach) - found.load;
    // f′ = 1 + k_b/kn is of order one here.
    assert!(
        balance.abs() <= 5.0 * PRELOAD_TOLERANCE * load,
        "{balance:e} N"
    );
    // With the whole stretch worn away, the preload is lost, also for a solved contact.
    let faces = worn(20e-6);
    let loose = preload(bolt, None, |n| contact(&faces, n)).expect_err("loose");
    assert!(matches!(loose, ModelUpdateError::Loose { .. }), "{loose:?}");
}
