//! Tests of the laws of contact elements from the fine contact: banks of sliders against the fine contact, and closed forms.

use fretwear::contact::normal::{self, NormalOptions, NormalProblem, NormalSolution};
use fretwear::contact::tangential::{self, TangentialOptions, TangentialProblem};
use fretwear::contact::{HalfSpace, Shear};
use fretwear::grid::{Grid, Patch};
use fretwear::model_update::{ContactElements, ElementParameters, Laws, Loading};
use fretwear::reference::CattaneoMindlin;
use fretwear::structure::element::Formulation;

use super::{ROUNDING, STEEL, assert_close, half_space, noise, sliders};
use crate::contact::nodes::without_mesh;
use crate::contact::{limit_of, moved_by, paraboloid, sheared};

const FRICTION: f64 = 0.6;
const LOAD: f64 = 40.0;
/// Boxes of the mesh along x and y.
const COUNTS: [usize; 2] = [4, 3];

/// Largest errors of eight sliders against their fine contact, if all cells have the same displacement, above a tenth of full sliding:
/// relative error of the energy per cycle, and error of the elements' forces relative to their sum.
const ENERGY: f64 = 0.06;
const FORCE: f64 = 0.02;
/// The same errors for banks that follow the motion of the cells. If little slips, lifted corners cause errors of a few hundredths of the
/// energy. The law of an element does not include forces across its path.
const ENERGY_OF_MOTION: f64 = 0.05;
const FORCE_OF_MOTION: f64 = 0.02;
/// Relative error of the elements' forces along their path at its end: a rising slope before the end is the only source of error.
const FORCE_AT_THE_END: f64 = 4e-3;
/// Largest error of the backbones against their banks: in this test, some slopes rise.
const REMAINDER: f64 = 0.03;

/// Heights with waves of three lengths on 40 × 36 cells; no wavelength divides the mesh.
fn rough() -> (Grid, Vec<f64>) {
    let grid = Grid::over([4e-3, 3e-3], [40, 36]);
    let height = |c| {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        let wave = |a: f64, b: f64, phase: f64| (a * x / 1e-3 + b * y / 1e-3 + phase).cos();
        2e-7 * (wave(5.1, 2.3, 0.4) + wave(-3.0, 6.7, 1.9) + wave(8.3, 7.1, 2.5))
    };
    (grid, (0..grid.len()).map(height).collect())
}

/// Half space without the compliance of its mesh.
fn local(grid: Grid) -> HalfSpace {
    without_mesh(grid, COUNTS, &[1e-3; 3], Formulation::IncompatibleModes)
}

fn nodes(grid: Grid) -> ContactElements {
    let faces: Vec<[usize; 2]> = (0..COUNTS[0] * COUNTS[1])
        .map(|c| [c / COUNTS[1], c % COUNTS[1]])
        .collect();
    ContactElements::at_nodes(grid, COUNTS, &faces).expect("elements")
}

/// Rough contact under [`LOAD`].
fn pressed() -> (Patch, NormalSolution) {
    let (grid, height) = rough();
    let patch = Patch::full(grid);
    let problem = NormalProblem::new(&patch, &height, LOAD);
    let options = NormalOptions::default();
    let contact = normal::solve(&mut half_space(grid), &problem, None, options).expect("contact");
    (patch, contact)
}

/// Energy of a cycle between ±`amplitude`, and the force of each element at the end of the cycle, from sliders under constant load.
fn of_banks(laws: &Laws, amplitude: f64) -> (f64, Vec<f64>) {
    let sliders = laws.parameters.sliders.as_ref().expect("sliders");
    let mut force = vec![0.0; laws.parameters.normal_load.len()];
    let mut energy = 0.0;
    for (s, &element) in sliders.element.iter().enumerate() {
        let (k, limit) = (sliders.kt[s], FRICTION * sliders.normal_load[s]);
        force[element] += (k * amplitude).min(limit);
        if limit > 0.0 {
            energy += 4.0 * limit * (amplitude - limit / k).max(0.0);
        }
    }
    (energy, force)
}

#[test]
fn banks_do_what_the_fine_contact_does() {
    let (patch, contact) = pressed();
    let grid = patch.grid;
    let elements = nodes(grid);
    let mut half_space = local(grid);
    for shear in [Shear::AlongX, Shear::InPlane] {
        let state = [&contact.pressure[..], &contact.gap[..]];
        let laws =
            Laws::new(&mut half_space, &elements, state, FRICTION, None, shear).expect("laws");
        let sliders = laws.parameters.sliders.as_ref().expect("sliders");
        // The sums over the sliders of an element equal its load and its stiffness.
        let mut sums = vec![[0.0; 3]; elements.len()];
        for (s, &element) in sliders.element.iter().enumerate() {
            assert!(sliders.normal_load[s] >= 0.0 && sliders.kn[s] >= 0.0 && sliders.kt[s] >= 0.0);
            // The other sliders close under a larger load.
            if sliders.gap[s] == 0.0 {
                sums[element][0] += sliders.normal_load[s];
                sums[element][1] += sliders.kn[s];
                sums[element][2] += sliders.kt[s];
            }
        }
        for (e, [load, kn, kt]) in sums.into_iter().enumerate() {
            let of = &laws.parameters;
            if of.normal_load[e] > 0.0 {
                assert_close(load, of.normal_load[e], ROUNDING, "load");
                assert_close(kn, of.kn[e], ROUNDING, "kn");
                assert_close(kt, of.kt[e], ROUNDING, "kt");
            }
        }
        assert!(laws.backbone_error < REMAINDER, "{:e}", laws.backbone_error);
        let limit = limit_of(FRICTION, &contact.pressure);
        for amplitude in [5e-8, 1.5e-7, 4e-7, 1e-6] {
            let drive = match shear {
                Shear::AlongX => moved_by(&[amplitude]),
                Shear::InPlane => moved_by(&[amplitude, 0.0]),
            };
            let problem = sheared(&patch, &limit, None, &drive);
            let step = tangential::solve(
                &mut half_space,
                &problem,
                None,
                TangentialOptions::default(),
            );
            let step = step.expect("a step");
            let (energy, force) = of_banks(&laws, amplitude);
            let fine = elements.integrals(&step.shear[0]);
            let off: f64 = fine.iter().zip(&force).map(|(a, b)| (a - b).abs()).sum();
            assert!(
                off < FORCE * step.force[0],
                "{amplitude:e}: {off:e} of {:e} N",
                step.force[0]
            );
            let expected = 4.0 * step.dissipation;
            assert_close(
                energy,
                expected,
                ENERGY,
                &format!("energy at {amplitude:e}"),
            );
        }
    }
}

/// One element over one contact spot: the bank follows the closed form of a sphere under a tangential force. The bank also follows it at
/// other loads, at which some of its sliders open and others close.
#[test]
fn a_bank_of_a_sphere_is_cattaneo_and_mindlin_at_other_loads() {
    let pair = fretwear::contact::Pair::same(fretwear::contact::Elastic {
        poisson_ratio: 0.0,
        ..STEEL
    });
    let at = |load: f64| CattaneoMindlin {
        radius: 0.1,
        load,
        friction_coefficient: FRICTION,
        pair,
    };
    let exact = at(100.0);
    let grid = Grid::over([1.1e-3, 1.0e-3], [96, 80]);
    let height = paraboloid(grid, exact.radius, (0.0, 0.0));
    let patch = Patch::full(grid);
    let mut half_space = HalfSpace::new(grid, pair, fretwear::contact::Boundary::Free);
    let problem = NormalProblem::new(&patch, &height, exact.load);
    let contact =
        normal::solve(&mut half_space, &problem, None, NormalOptions::default()).expect("contact");
    let elements = ContactElements::single(grid).expect("one element");
    let state = [&contact.pressure[..], &contact.gap[..]];
    let laws = Laws::new(
        &mut half_space,
        &elements,
        state,
        FRICTION,
        None,
        Shear::AlongX,
    )
    .expect("laws");
    let sliders = laws.parameters.sliders.as_ref().expect("sliders");
    let left = |s: usize, back: f64| {
        let compressed = back + sliders.gap[s];
        (sliders.normal_load[s] - sliders.kn[s] * compressed).max(0.0)
    };
    // The normal law of the bank gives the approach at other loads.
    for (load, bound) in [(100.0, 0.03), (50.0, 0.07), (130.0, 0.03), (160.0, 0.05)] {
        let borne = |back: f64| -> f64 { (0..sliders.kn.len()).map(|s| left(s, back)).sum() };
        let (mut low, mut high) = (-1e-4, 1e-4);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if borne(middle) > load {
                low = middle
            } else {
                high = middle
            }
        }
        let exact = at(load);
        for part in [0.15, 0.4, 0.7, 1.2] {
            let displacement = part * exact.sliding_displacement();
            let force: f64 = (0..sliders.kt.len())
                .map(|s| (sliders.kt[s] * displacement).min(FRICTION * left(s, low)))
                .sum();
            let expected = exact.force(displacement.min(exact.sliding_displacement()));
            assert!(
                (force - expected).abs() < bound * FRICTION * load,
                "{part} of full sliding at {load} N: {force} N, expected {expected} N"
            );
        }
    }
}

#[test]
fn without_friction_or_load_there_is_no_stiffness_to_slide_with() {
    let (grid, _) = rough();
    let elements = nodes(grid);
    // One corner of the joint carries the whole load.
    let pressure: Vec<f64> = (0..grid.len())
        .map(|c| {
            if grid.cell(c).0 < 8 && grid.cell(c).1 < 8 {
                1e6
            } else {
                0.0
            }
        })
        .collect();
    let gap = noise(grid.len());
    for mu in [0.0, FRICTION] {
        let state = [&pressure[..], &gap[..]];
        let laws =
            Laws::new(&mut local(grid), &elements, state, mu, None, Shear::AlongX).expect("laws");
        let sliders = laws.parameters.sliders.as_ref().expect("sliders");
        for (s, &element) in sliders.element.iter().enumerate() {
            let loaded = laws.parameters.normal_load[element] > 0.0;
            assert!(loaded || sliders.gap[s] > 0.0, "element {element}");
            assert_eq!(sliders.kt[s] > 0.0, mu > 0.0, "element {element}");
        }
        assert_eq!(sliders.element.last(), Some(&(elements.len() - 1)));
    }
}

/// Cells move with the nodes of a mesh, some four times as far as others: banks of this motion reproduce the fine contact, and banks of one
/// common displacement do not.
#[test]
fn banks_of_a_motion_do_what_the_fine_contact_does_under_it() {
    let (patch, contact) = pressed();
    let grid = patch.grid;
    let elements = nodes(grid);
    let mut half_space = local(grid);
    let state = [&contact.pressure[..], &contact.gap[..]];
    let shear = Shear::InPlane;
    let laws = Laws::new(&mut half_space, &elements, state, FRICTION, None, shear).expect("laws");
    let limit = limit_of(FRICTION, &contact.pressure);
    for reach in [4e-8, 1.2e-7, 4e-7] {
        let reach: Vec<[f64; 2]> = elements
            .centres()
            .iter()
            .map(|[x, y]| [reach * (1.0 + 300.0 * x), reach * 200.0 * y])
            .collect();
        let nodes = elements.nodes().expect("nodes");
        let offset = |part: f64| -> Vec<Vec<f64>> {
            let axis = |axis: usize| {
                let mut at = vec![0.0; nodes.interpolation.nodes()];
                let pairs = nodes.numbers.iter().zip(&reach);
                pairs.for_each(|(&node, reach)| at[node] = part * reach[axis]);
                let mut field = vec![0.0; grid.len()];
                nodes.interpolation.add_interpolated(1.0, &at, &mut field);
                field
            };
            vec![axis(0), axis(1)]
        };
        let parts = Loading::parts(&laws.parameters, &reach, FRICTION);
        let turn = parts.iter().position(|part| *part == 1.0).expect("the end");
        let mut solve = |part: f64| {
            let offset = offset(part);
            let drive = moved_by(&[0.0, 0.0]);
            let problem = TangentialProblem {
                offset: Some(&offset),
                ..sheared(&patch, &limit, None, &drive)
            };
            let options = TangentialOptions::default();
            tangential::solve(&mut half_space, &problem, None, options).expect("a step")
        };
        let steps: Vec<_> = parts.iter().map(|part| solve(*part)).collect();
        let expected = 4.0 * steps[turn].dissipation;
        let shears: Vec<_> = steps.iter().map(|step| step.shear.clone()).collect();
        let loading = Loading::new(&elements, reach.clone(), parts, &shears);
        let of = |parameters: &ElementParameters| -> (f64, f64, f64) {
            let sliders = parameters.sliders.as_ref().expect("sliders");
            let (mut energy, mut force) = (0.0, vec![0.0; elements.len()]);
            for (s, &element) in sliders.element.iter().enumerate() {
                let u = reach[element][0].hypot(reach[element][1]);
                let (k, limit) = (sliders.kt[s], FRICTION * sliders.normal_load[s]);
                force[element] += (k * u).min(limit);
                if limit > 0.0 {
                    energy += 4.0 * limit * (u - limit / k).max(0.0);
                }
            }
            let fine = elements.integrals(&shears[turn][0]);
            let across = elements.integrals(&shears[turn][1]);
            let along = fine.iter().zip(&across).zip(&reach);
            let along = along.map(|((fx, fy), [x, y])| (fx * x + fy * y) / x.hypot(*y));
            let at_the_end: f64 = along.zip(&force).map(|(a, f)| (a - f).abs()).sum();
            let pairs = fine.iter().zip(&force).zip(&reach);
            let off: f64 = pairs
                .map(|((fine, bank), [x, y])| (fine - bank * x / x.hypot(*y)).abs())
                .sum();
            let all = steps[turn].force[0];
            (energy / expected - 1.0, off / all, at_the_end / all)
        };
        let refined = loading.laws(&laws.parameters, FRICTION);
        let (before, after) = (of(&laws.parameters), of(&refined));
        assert!(after.0.abs() < ENERGY_OF_MOTION, "{before:?}, {after:?}");
        assert!(after.1 < FORCE_OF_MOTION, "{before:?}, {after:?}");
        assert!(after.2 < FORCE_AT_THE_END, "{before:?}, {after:?}");
        // Where everything slides, only the forces across the path contribute to the error.
        if before.1 > FORCE_OF_MOTION {
            assert!(after.1 < 0.5 * before.1, "{before:?}, {after:?}");
        }
    }
}

/// The force of an element rises in proportion far beyond the end of the motion, and then the element slides. The backbone gives the force
/// at the end of the motion, and the corner beyond this end has no influence.
#[test]
fn what_lies_beyond_the_end_of_a_motion_does_not_stiffen_what_comes_before() {
    const WAY: f64 = 2e-6;
    const KT: f64 = 1e7;
    let strength = 3.0 * KT * WAY;
    let load = strength / FRICTION;
    let laws = ElementParameters {
        normal_load: vec![load],
        gap: vec![0.0],
        kn: vec![2e7],
        kt: vec![KT],
        sliders: Some(sliders(&[(0, [load, 0.0, 2e7, KT])])),
    };
    let reach = vec![[WAY, 0.0]];
    let parts = Loading::parts(&laws, &reach, FRICTION);
    let force = parts
        .iter()
        .map(|part| vec![[KT * part * WAY, 0.0]])
        .collect();
    let loading = Loading {
        amplitude: reach,
        parts,
        force,
    };
    let found = loading.laws(&laws, FRICTION);
    let sliders = found.sliders.as_ref().expect("sliders");
    let at_the_end: f64 = (0..sliders.element.len())
        .map(|s| (sliders.kt[s] * WAY).min(FRICTION * sliders.normal_load[s]))
        .sum();
    assert_close(at_the_end, KT * WAY, ROUNDING, "force at the end");
}
