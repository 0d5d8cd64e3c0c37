use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::contact::stiffness::Stiffness;
use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair, Shear};
use fretwear::grid::{Grid, Patch};
use fretwear::model_update::{
    Compliance, ContactElements, Distribution, Linearisation, ModelUpdateError,
    SMALLEST_COMPLIANCE, Springs, fine_displacement,
};

use super::{ROUNDING, STEEL, assert_close, half_space, noise, resonator, small};

/// Tolerance: the published stiffnesses have four digits, and their source does not specify the condition on the transverse displacement.
const KNOWN: f64 = 3e-3;

/// 40 × 40 mm with the staircase hole, smooth: kn 5009, kt 4126 N/µm.
#[test]
fn the_smooth_patch_has_the_known_stiffness() {
    let elements = resonator(Grid::over([40e-3, 40e-3], [256, 256]));
    let mut half_space = half_space(elements.grid());
    for shear in [Shear::AlongX, Shear::InPlane] {
        let smooth =
            Compliance::smooth(&mut half_space, elements.patch(), shear).expect("full contact");
        assert_close(smooth.kn(), 5009e6, KNOWN, "kn");
        assert_close(smooth.kt(), 4126e6, KNOWN, "kt");
    }
}

/// Pressure of a contact with scattered open cells.
fn some_contact(elements: &ContactElements) -> Vec<f64> {
    let kept = &elements.patch().is_in_joint;
    noise(kept.len())
        .iter()
        .zip(kept)
        .map(|(x, &kept)| if kept && *x > 0.4 { 1e8 * x } else { 0.0 })
        .collect()
}

#[test]
fn elements_of_the_tangent_stiffness_sum_to_it() {
    for elements in [small(), resonator(Grid::over([40e-3, 30e-3], [48, 40]))] {
        let pressure = some_contact(&elements);
        let mut half_space = half_space(elements.grid());
        let linearisation = Linearisation::new(&mut half_space, &pressure, None, Shear::InPlane)
            .expect("a contact");
        let springs = Springs::Tangent(&linearisation);
        let [kn, kt] = springs
            .distribute(&elements, &elements.loads(&pressure))
            .expect("springs");
        let total = linearisation.compliance();
        assert_close(kn.iter().sum(), total.kn(), ROUNDING, "kn");
        assert_close(kt.iter().sum(), total.kt(), ROUNDING, "kt");
        assert!(kn.iter().chain(&kt).all(|&k| k >= 0.0));
        assert_eq!(springs.compliance(), total);
    }
}

/// The approach of a flat punch is N/kn, and its contact does not change. So the loads of the elements are proportional to their stiffness.
#[test]
fn tangent_elements_of_a_flat_bear_as_the_contact_solver_says() {
    let elements = small();
    let mut half_space = half_space(elements.grid());
    let height = vec![0.0; elements.grid().len()];
    let problem = NormalProblem::new(elements.patch(), &height, 500.0);
    let options = NormalOptions {
        tolerance: 1e-10,
        ..NormalOptions::default()
    };
    let solution = normal::solve(&mut half_space, &problem, None, options).expect("contact");
    let linearisation =
        Linearisation::new(&mut half_space, &solution.pressure, None, Shear::AlongX)
            .expect("a contact");
    let loads = elements.loads(&solution.pressure);
    let [kn, _] = Springs::Tangent(&linearisation)
        .distribute(&elements, &loads)
        .expect("springs");
    for (k, load) in kn.iter().zip(&loads) {
        // The error of the linearisation's field is of the order of its residual, unlike the error of its energy.
        assert_close(*k, load / solution.approach, 1e-5, "kn of an element");
    }
}

/// For a Poisson ratio of 0, shear causes the same displacement as pressure.
#[test]
fn without_lateral_contraction_kt_of_an_element_is_its_kn() {
    let elements = small();
    let material = Elastic {
        poisson_ratio: 0.0,
        ..STEEL
    };
    let grid = elements.grid();
    let mut half_space = HalfSpace::new(grid, Pair::same(material), Boundary::Free);
    let pressure = some_contact(&elements);
    let linearisation =
        Linearisation::new(&mut half_space, &pressure, None, Shear::InPlane).expect("a contact");
    let [kn, kt] = Springs::Tangent(&linearisation)
        .distribute(&elements, &elements.loads(&pressure))
        .expect("springs");
    for (kn, kt) in kn.iter().zip(&kt) {
        assert_close(*kt, *kn, 1e-5, "kt of an element");
    }
}

#[test]
fn capped_cells_count_in_kt_alone() {
    let elements = small();
    let cap = 0.9e8;
    let mut pressure: Vec<f64> = some_contact(&elements).iter().map(|p| p.min(cap)).collect();
    // All loaded cells of the first element are capped, including cells shared with other elements.
    for c in 0..pressure.len() {
        let mut one = vec![0.0; pressure.len()];
        one[c] = 1.0;
        if elements.sums(&one)[0] > 0.0 && pressure[c] > 0.0 {
            pressure[c] = cap;
        }
    }
    let mut half_space = half_space(elements.grid());
    let linearisation = Linearisation::new(&mut half_space, &pressure, Some(cap), Shear::AlongX)
        .expect("a contact");
    let [kn, kt] = Springs::Tangent(&linearisation)
        .distribute(&elements, &elements.loads(&pressure))
        .expect("springs");
    assert_eq!(kn[0], 0.0);
    assert!(kt[0] > 0.0);
    assert!(kn[1..].iter().chain(&kt[1..]).all(|&k| k > 0.0));
}

#[test]
fn roughness_and_the_smooth_patch_in_series_are_the_total() {
    let total = Compliance::from_stiffness(3606e6, 2973e6);
    let smooth = Compliance::from_stiffness(5009e6, 4126e6);
    let roughness = total.subtract_series(smooth);
    // Difference of the compliances at Rq 5 µm, from stiffnesses with four digits.
    assert_close(roughness.kn(), 12_880e6, 1e-3, "kn");
    let series = |a: f64, b: f64| a * b / (a + b);
    assert_close(
        series(roughness.kn(), smooth.kn()),
        total.kn(),
        ROUNDING,
        "kn",
    );
    assert_close(
        series(roughness.kt(), smooth.kt()),
        total.kt(),
        ROUNDING,
        "kt",
    );
    // A contact as stiff as the smooth patch, or stiffer by rounding, has no compliance of the roughness.
    assert_eq!(smooth.subtract_series(smooth).kn(), f64::INFINITY);
    assert_eq!(
        Compliance::from_stiffness(5010e6, 4130e6)
            .subtract_series(smooth)
            .normal,
        0.0
    );
    // An open contact stays open.
    assert_eq!(
        Compliance::from_stiffness(0.0, 0.0)
            .subtract_series(smooth)
            .kn(),
        0.0
    );
}

#[test]
fn a_joint_without_roughness_left_has_a_finite_spring() {
    let elements = small();
    let smooth = Compliance::from_stiffness(5009e6, 4126e6);
    let springs = Springs::Roughness {
        total: smooth,
        smooth,
        distribution: Distribution::Uniform,
    };
    assert_eq!(springs.compliance().kn(), f64::INFINITY);
    let [kn, kt] = springs
        .distribute(&elements, &vec![1.0; elements.len()])
        .expect("springs");
    let sum = |k: &[f64]| k.iter().sum::<f64>();
    assert_close(sum(&kn), 5009e6 / SMALLEST_COMPLIANCE, ROUNDING, "kn");
    assert_close(sum(&kt), 4126e6 / SMALLEST_COMPLIANCE, ROUNDING, "kt");
}

#[test]
fn a_global_stiffness_is_divided_by_area_or_by_load() {
    let elements = small();
    let total = Compliance::from_stiffness(3606e6, 2973e6);
    let loads: Vec<f64> = (0..elements.len()).map(|e| e as f64).collect();
    let whole: f64 = loads.iter().sum();
    let divided = |distribution, loads: &[f64]| {
        let springs = Springs::Total {
            total,
            distribution,
        };
        springs.distribute(&elements, loads).expect("springs")
    };
    let [kn, kt] = divided(Distribution::Uniform, &loads);
    for e in 0..13 {
        assert_close(kn[e], 3606e6 / 13.0, ROUNDING, "kn by area");
        assert_close(kt[e], 2973e6 / 13.0, ROUNDING, "kt by area");
    }
    let [kn, kt] = divided(Distribution::ByLoad, &loads);
    for e in 0..13 {
        assert_close(kn[e], 3606e6 * loads[e] / whole, ROUNDING, "kn by load");
        assert_close(kt[e], 2973e6 * loads[e] / whole, ROUNDING, "kt by load");
    }
    let [kn, _] = divided(Distribution::ByLoad, &[0.0; 13]);
    assert_eq!(kn, [0.0; 13]);
}

/// A full contact under a periodic surface has no compliance: its stiffness field is zero and must not be used as a spring.
#[test]
fn a_joint_that_does_not_give_way_has_no_springs() {
    let grid = Grid::over([4e-3, 3e-3], [16, 12]);
    let elements = ContactElements::single(grid).expect("one element");
    let mut half_space = HalfSpace::new(grid, Pair::same(STEEL), Boundary::Periodic);
    let pressure = vec![1e6; grid.len()];
    let linearisation =
        Linearisation::new(&mut half_space, &pressure, None, Shear::AlongX).expect("a contact");
    let total = linearisation.compliance();
    let smooth = Compliance::smooth(&mut half_space, &Patch::full(grid), Shear::AlongX)
        .expect("full contact");
    assert_eq!(smooth.normal, 0.0);
    let distribution = Distribution::Uniform;
    for springs in [
        Springs::Tangent(&linearisation),
        Springs::Total {
            total,
            distribution,
        },
        Springs::Roughness {
            total,
            smooth,
            distribution,
        },
    ] {
        assert_eq!(
            springs.distribute(&elements, &[1.0]),
            Err(ModelUpdateError::Rigid { name: "kn" })
        );
    }
}

#[test]
fn an_element_that_is_drawn_the_other_way_has_no_stiffness() {
    let grid = Grid::over([4e-3, 2e-3], [4, 3]);
    let cells = [[0, 0], [1, 0], [2, 0], [3, 0]];
    let elements = ContactElements::new(grid, [4, 1], &cells).expect("elements");
    let field: Vec<f64> = [5.0, -1.0, 2.0, 6.0]
        .iter()
        .flat_map(|&k| [k / 3.0; 3])
        .map(|k| k / grid.cell_area())
        .collect();
    let stiffness = Stiffness {
        density: vec![field],
        total: 12.0,
        iterations: 1,
    };
    let linearisation = Linearisation {
        kn: stiffness.clone(),
        kt: stiffness,
    };
    let [kn, kt] = Springs::Tangent(&linearisation)
        .distribute(&elements, &[1.0; 4])
        .expect("springs");
    assert_eq!(kn, kt);
    for (found, expected) in kn.iter().zip([60.0 / 13.0, 0.0, 24.0 / 13.0, 72.0 / 13.0]) {
        assert!((found - expected).abs() < 12.0 * ROUNDING, "{kn:?}");
    }
}

/// Under a stuck joint, the displacement of springs and bodies equals the displacement of the whole fine contact.
#[test]
fn the_fine_contact_is_displaced_by_the_bodies_too() {
    let total = Compliance::from_stiffness(3606e6, 2973e6);
    let smooth = Compliance::from_stiffness(5009e6, 4126e6);
    let spring = total.subtract_series(smooth);
    let force = vec![vec![0.0, 700.0, -900.0], vec![120.0, 0.0, 50.0]];
    let stretch = |c: f64| -> Vec<Vec<f64>> {
        force
            .iter()
            .map(|samples| samples.iter().map(|t| c * t).collect())
            .collect()
    };
    let found = fine_displacement(&stretch(spring.tangential), &force, smooth.tangential);
    for (found, expected) in found.iter().zip(&stretch(total.tangential)) {
        for (found, expected) in found.iter().zip(expected) {
            assert_close(*found, *expected, ROUNDING, "displacement");
        }
    }
}
