//! Tests of the effect of a varying load on the work of friction of contact elements.

use fretwear::dynamics::cycle::{LARGEST_PART, WorkBetweenEnds, joint_cycle};
use fretwear::dynamics::{ContactElement, FrictionLaw, Harmonics, Sampling};

use super::{changed, element};

const SAMPLES: usize = 512;
/// Relative tolerance: the error of sums over half waves is quadratic in the distance of the samples, and an element sticks for a small
/// part of the path.
const SAMPLED: f64 = 1e-3;
/// Amplitude along x [m], thousands of times the elastic displacement of the spring.
const WAY: f64 = 1e-3;

/// Element that slides at once.
fn sliding() -> ContactElement {
    changed(&element(FrictionLaw::Cone), |slider| {
        slider.tangential_stiffness = 1e10;
        slider.gap = 0.0;
    })
}

/// Work of elements with the normal displacement `normal` cos(order θ) and the displacement cos θ along x, with one amplitude per element.
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

/// ∮ µ(N + a cos 2θ) |d cos θ| = µ(4N − 4a/3); a load at the frequency of the motion has no effect.
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

/// The loss of one element does not cancel the gain of another element in the sum of changes.
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

/// An element that slips only because its load decreases keeps the ratio 1, and its dissipation counts as unrepresented.
#[test]
fn what_slips_by_its_load_alone_is_untold() {
    let element = sliding();
    let strength = element.friction_coefficient * element.normal_load();
    let normal = 0.9 * element.normal_load() / element.normal_stiffness();
    // The element is near its friction limit at the ends, where a load of twice the frequency is largest, and far beyond it between them.
    let of = |part: f64| {
        let way = part * strength / element.tangential_stiffness();
        work(std::slice::from_ref(&element), &[way], [-normal, 2.0])
    };
    let found = of(0.9);
    assert_eq!(found.part, [1.0]);
    assert!((found.unrepresented_share - 1.0).abs() < 1e-12, "{found:?}");
    // The ratio of an element that hardly slips between the ends is limited.
    let found = of(1.001);
    assert_eq!(found.part, [LARGEST_PART]);
    assert!(found.unrepresented_share > 0.5, "{found:?}");
}

/// Without motion there is no dissipation.
#[test]
fn at_rest_there_is_nothing_to_change() {
    let found = work(&[sliding()], &[0.0], [0.0, 1.0]);
    assert_eq!(found.part, [1.0]);
    assert_eq!((found.changed_share, found.unrepresented_share), (0.0, 0.0));
}
