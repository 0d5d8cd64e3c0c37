//! What the variation of the load makes of the work of friction of contact elements.

use fretwear::dynamics::cycle::{LARGEST_PART, WorkBetweenEnds, joint_cycle};
use fretwear::dynamics::{ContactElement, FrictionLaw, Harmonics, Sampling};

use super::{changed, element};

const SAMPLES: usize = 512;
/// Sums over so many samples of half waves are right to their square; the last is the way to slide, over the way in all.
const SAMPLED: f64 = 1e-3;
/// Way along x [m]: thousands of times that of the spring.
const WAY: f64 = 1e-3;

/// An element that slides at once.
fn sliding() -> ContactElement {
    changed(&element(FrictionLaw::Cone), |slider| {
        slider.tangential_stiffness = 1e10;
        slider.gap = 0.0;
    })
}

/// Of elements with `normal` approach cos(order θ) on their way cos θ along x, one way each.
fn work(elements: &[ContactElement], ways: &[f64], [normal, order]: [f64; 2]) -> WorkBetweenEnds {
    let sampling = Sampling::new(Harmonics::up_to(2), SAMPLES).expect("samples");
    let row = |way: &f64| {
        let mut row = [0.0; 15];
        row[1] = *way;
        row[10 + 2 * order as usize - 1] = normal;
        row
    };
    let displacement: Vec<f64> = ways.iter().flat_map(row).collect();
    let places = vec![[0.0; 2]; elements.len()];
    let cycle = joint_cycle(elements, &displacement, &sampling, &places).expect("a cycle");
    WorkBetweenEnds::of(elements, &displacement, &sampling, &cycle)
}

/// ∮ µ(N + a cos 2θ) |d cos θ| = µ(4N − 4a/3); a load of the motion's own frequency has no part in it.
#[test]
fn a_load_of_twice_the_frequency_takes_a_third_of_it() {
    let element = sliding();
    let (load, kn) = (element.normal_load(), element.normal_stiffness());
    for share in [0.1, 0.4, 0.9] {
        let normal = share * load / kn;
        let found = work(std::slice::from_ref(&element), &[WAY], [normal, 2.0]);
        let expected = 1.0 - share / 3.0;
        assert!((found.part[0] - expected).abs() < SAMPLED, "{found:?}");
        let changed = share / 3.0 / expected;
        assert!((found.changed_share - changed).abs() < SAMPLED, "{found:?}");
        assert!(found.unrepresented_share < 1e-12, "{found:?}");
        let found = work(std::slice::from_ref(&element), &[WAY], [normal, 1.0]);
        assert!((found.part[0] - 1.0).abs() < SAMPLED, "{found:?}");
    }
}

/// What one element loses does not make good for what another gains.
#[test]
fn changes_of_single_elements_add_up() {
    let element = sliding();
    let normal = 0.3 * element.normal_load() / element.normal_stiffness();
    let other = changed(&element, |slider| slider.normal_stiffness *= -1.0);
    let found = work(&[element, other], &[WAY, WAY], [normal, 2.0]);
    assert!((found.part[0] - 0.9).abs() < SAMPLED, "{found:?}");
    assert!((found.part[1] - 1.1).abs() < SAMPLED, "{found:?}");
    assert!((found.changed_share - 0.1).abs() < SAMPLED, "{found:?}");
}

/// An element that slips only since its load leaves it has no part of anything, and is said to be untold.
#[test]
fn what_slips_by_its_load_alone_is_untold() {
    let element = sliding();
    let strength = element.friction_coefficient * element.normal_load();
    let normal = 0.9 * element.normal_load() / element.normal_stiffness();
    // Nearly at its strength at the ends, where a load of twice the frequency is largest, and far beyond it between them.
    let of = |part: f64| {
        let way = part * strength / element.tangential_stiffness();
        work(std::slice::from_ref(&element), &[way], [-normal, 2.0])
    };
    let found = of(0.9);
    assert_eq!(found.part, [1.0]);
    assert!((found.unrepresented_share - 1.0).abs() < 1e-12, "{found:?}");
    // One that hardly slips between the ends has the largest part at most.
    let found = of(1.001);
    assert_eq!(found.part, [LARGEST_PART]);
    assert!(found.unrepresented_share > 0.5, "{found:?}");
}

/// Nothing moves, nothing is dissipated.
#[test]
fn at_rest_there_is_nothing_to_change() {
    let found = work(&[sliding()], &[0.0], [0.0, 1.0]);
    assert_eq!(found.part, [1.0]);
    assert_eq!((found.changed_share, found.unrepresented_share), (0.0, 0.0));
}
