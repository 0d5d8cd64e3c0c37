//! The joint as one element against its elements as they are.

use fretwear::dynamics::closure::ClosureEnergy;
use fretwear::dynamics::cycle::joint_cycle;
use fretwear::dynamics::{ContactElement, FrictionLaw, Harmonics, Sampling};
use fretwear::reference::Jenkins;

use super::{changed, element};

/// Loops of straight motion are integrated exactly but for their reversals, which samples of a cosine hit.
const EXACT: f64 = 1e-4;
/// Displacement amplitude of an element that slides [m].
const AMPLITUDE: f64 = 9e-6;

/// Elements moving along x by their amplitudes, in phase.
fn closure(elements: &[ContactElement], amplitudes: &[f64]) -> ClosureEnergy {
    let harmonics = Harmonics::up_to(1);
    let width = 3 * harmonics.coefficients();
    let mut displacement = vec![0.0; width * elements.len()];
    for (row, amplitude) in displacement.chunks_mut(width).zip(amplitudes) {
        row[1] = *amplitude;
    }
    let sampling = Sampling::new(harmonics, 512).expect("samples");
    let positions = vec![[0.0; 2]; elements.len()];
    let joint = joint_cycle(elements, &displacement, &sampling, &positions).expect("a cycle");
    ClosureEnergy::new(elements, &displacement, &sampling, &joint)
}

/// Closed form.
fn sliding(element: &ContactElement, amplitude: f64) -> f64 {
    let jenkins = Jenkins {
        stiffness: element.tangential_stiffness(),
        limit: element.friction_coefficient * element.normal_load(),
    };
    jenkins.dissipated_energy(amplitude)
}

/// Nothing is lost where loads are in proportion to stiffness.
#[test]
fn elements_that_move_alike_are_one() {
    let one = element(FrictionLaw::Cone);
    let double = ContactElement {
        area: 2.0 * one.area,
        ..changed(&one, |slider| {
            slider.normal_load *= 2.0;
            slider.tangential_stiffness *= 2.0;
            slider.normal_stiffness *= 2.0;
        })
    };
    let expected = sliding(&one, AMPLITUDE) + sliding(&double, AMPLITUDE);
    let found = closure(&[one, double], &[AMPLITUDE; 2]);
    assert!(
        (found.mean_motion / expected - 1.0).abs() < EXACT,
        "{found:?} instead of {expected:e} J"
    );
    assert!(found.error < EXACT * expected, "{found:?}");
}

/// One sticks under a high load, the other slides; as one joint both slide, by little.
#[test]
fn unlike_loads_and_motions() {
    let light = element(FrictionLaw::Cone);
    let heavy = changed(&light, |slider| slider.normal_load *= 5.0);
    let amplitudes = [AMPLITUDE, 0.5 * AMPLITUDE];
    let apart = sliding(&light, amplitudes[0]) + sliding(&heavy, amplitudes[1]);
    let whole = changed(&light, |slider| {
        slider.normal_load += heavy.normal_load();
        slider.tangential_stiffness *= 2.0;
    });
    let together = sliding(&whole, 0.75 * AMPLITUDE);
    assert!(0.0 < together && together < 0.5 * apart);
    let found = closure(&[light, heavy], &amplitudes);
    assert!(
        (found.mean_motion / together - 1.0).abs() < EXACT,
        "{found:?} instead of {together:e} J"
    );
    assert!(
        (found.error / (apart - together) - 1.0).abs() < EXACT,
        "{found:?} instead of {:e} J",
        apart - together
    );
}

/// Opposite motions have no mean; all of the work of friction is lost with it.
#[test]
fn motions_that_cancel() {
    let each = changed(&element(FrictionLaw::Cone), |slider| {
        slider.tangential_stiffness *= 1e3;
    });
    let found = closure(&[each.clone(), each.clone()], &[AMPLITUDE, -AMPLITUDE]);
    let work = 8.0 * each.friction_coefficient * each.normal_load() * AMPLITUDE;
    assert_eq!(found.mean_motion, 0.0);
    assert!(
        (found.error / work - 1.0).abs() < EXACT,
        "{found:?} of {work:e} J"
    );
}

/// An element without load neither moves the others nor adds its stiffness; a joint that sticks loses nothing.
#[test]
fn elements_without_load_and_without_slip() {
    let loaded = element(FrictionLaw::Cone);
    let open = changed(&loaded, |slider| {
        (slider.normal_load, slider.gap) = (0.0, 1e-3);
    });
    let both = closure(&[loaded.clone(), open.clone()], &[AMPLITUDE; 2]);
    assert!((both.mean_motion / sliding(&loaded, AMPLITUDE) - 1.0).abs() < EXACT);
    assert_eq!(closure(&[open], &[AMPLITUDE]), ClosureEnergy::default());
    assert_eq!(closure(&[], &[]), ClosureEnergy::default());
    let stuck = closure(
        &[loaded.clone(), loaded],
        &[1e-3 * AMPLITUDE, 1e-2 * AMPLITUDE],
    );
    assert_eq!(stuck, ClosureEnergy::default());
}
