//! What one mean displacement makes wrong in the energy of a fine contact whose parts move differently, against the estimate from
//! contact elements that is part of the error bars.

use fretwear::contact::Shear;
use fretwear::dynamics::closure::ClosureEnergy;
use fretwear::dynamics::cycle::joint_cycle;
use fretwear::dynamics::{ContactElement, FrictionLaw, Harmonics, Sampling, Slider};
use fretwear::model_update::Linearisation;
use fretwear::wear::Harmonic;
use fretwear::wear::cycle::March;

use super::{FRICTION, driven, joint, unworn};

/// Contact elements along x and y.
const ELEMENTS: [usize; 2] = [8, 8];
/// Displacement amplitude of the middle of the joint [m].
const AMPLITUDE: f64 = 2e-6;
/// Half the side of the joint [m].
const HALF: f64 = 2e-3;

fn harmonic(amplitude: f64) -> Harmonic {
    Harmonic {
        amplitude,
        phase: 0.0,
        is_force: false,
    }
}

/// Energy of a cycle of the fine contact: the middle moves by [`AMPLITUDE`] along x, the bodies turn by `angle` in phase with it.
fn fine(angle: f64) -> f64 {
    let axes = [harmonic(AMPLITUDE), harmonic(0.0)];
    let motion = driven(&axes, Some(harmonic(angle)));
    unworn(&mut joint(motion, March::Reversal))
        .cycle
        .dissipation
}

/// The contact elements of the joint and where they are, as a structure gets them.
fn elements() -> (Vec<ContactElement>, Vec<[f64; 2]>) {
    let motion = driven(&[harmonic(0.0)], None);
    let mut joint = joint(motion, March::Reversal);
    let pressure = unworn(&mut joint).pressure;
    let grid = joint.patch.grid;
    let linear = Linearisation::new(&mut joint.half_space, &pressure, None, Shear::InPlane);
    let stiffness = 1.0 / linear.expect("a linearisation").compliance().tangential;
    let [nx, ny] = ELEMENTS;
    let mut load = vec![0.0; nx * ny];
    for (index, p) in pressure.iter().enumerate() {
        let (i, j) = grid.cell(index);
        load[i * nx / grid.nx * ny + j * ny / grid.ny] += p * grid.cell_area();
    }
    let loaded = load.iter().filter(|load| **load > 0.0).count();
    let centre = |k: usize, n: usize| (k as f64 + 0.5) * 2.0 * HALF / n as f64 - HALF;
    let each = load.iter().enumerate().map(|(e, &normal_load)| {
        let element = ContactElement {
            area: 4.0 * HALF * HALF / (nx * ny) as f64,
            friction_coefficient: FRICTION,
            law: FrictionLaw::Cone,
            sliders: vec![Slider {
                normal_load,
                gap: 0.0,
                tangential_stiffness: stiffness / loaded as f64,
                normal_stiffness: stiffness / loaded as f64,
            }],
        };
        (element, [centre(e / ny, nx), centre(e % ny, ny)])
    });
    each.unzip()
}

#[test]
fn the_estimate_holds_what_a_mean_displacement_makes_wrong() {
    let (elements, positions) = elements();
    let harmonics = Harmonics::up_to(1);
    let width = 3 * harmonics.coefficients();
    let sampling = Sampling::new(harmonics, 512).expect("samples");
    let mean = fine(0.0);
    for share in [0.25, 0.5, 1.0] {
        // The edges move by that share of the mean more and less.
        let angle = share * AMPLITUDE / HALF;
        let truth = fine(angle);
        let mut displacement = vec![0.0; width * elements.len()];
        for (row, [x, y]) in displacement.chunks_mut(width).zip(&positions) {
            row[1] = AMPLITUDE - angle * y;
            row[4] = angle * x;
        }
        let moved = joint_cycle(&elements, &displacement, &sampling, &positions).expect("a cycle");
        let bar = ClosureEnergy::new(&elements, &displacement, &sampling, &moved).error;
        let wrong = (truth - mean).abs();
        println!(
            "{share}: {truth:e} J, by the mean {mean:e} J: off by {wrong:e}, estimated {bar:e}"
        );
        assert!(
            wrong <= bar,
            "{share}: off by {wrong:e} J, estimated {bar:e} J"
        );
    }
}
