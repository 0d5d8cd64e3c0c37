//! The backbone of a Jenkins oscillator against its describing function, over the samples of a cycle.

use std::f64::consts::TAU;

use super::{Measure, Row, rows_of};
use crate::dynamics::{
    ContactElement, DynamicsError, FrictionLaw, Harmonics, Levels, Oscillator, Settings, Slider,
    Vibration,
};
use crate::reference::{Jenkins, JenkinsOscillator};

/// Samples of a cycle: friction is exact at them, and between them its corners are cut.
const SAMPLES: [usize; 4] = [32, 64, 128, 256];
/// Levels of the force, from a joint that sticks to one that slides over some thirty times the displacement at which sliding begins.
const LEVELS: Levels = Levels {
    from: 2.0,
    to: 1000.0,
    count: Some(17),
};

/// Force, frequency and damping ratio of the phase resonance at the amplitudes of a backbone: harmonics 0 and 1, a steady normal load.
/// The grid is samples by levels.
///
/// # Errors
/// [`DynamicsError`] of a resonance that was not found.
pub fn jenkins_oscillator() -> Result<Vec<Row>, DynamicsError> {
    let exact = JenkinsOscillator {
        mass: 1.5,
        damping: 300.0,
        stiffness: 4.0e7,
        contact: Jenkins {
            stiffness: 2.5e7,
            limit: 54.0,
        },
    };
    let measured: Result<Vec<_>, _> = SAMPLES.iter().map(|s| measures(&exact, *s)).collect();
    let measured = measured?;
    let grids = SAMPLES.map(|samples| [samples, measured[0].0]);
    let widths = SAMPLES.map(|samples| 1.0 / samples as f64);
    let measured: Vec<Vec<Measure>> = measured.into_iter().map(|(_, m)| m).collect();
    Ok(rows_of("Jenkins oscillator", &grids, &widths, &measured))
}

/// Number of levels, and what is measured over them.
fn measures(
    exact: &JenkinsOscillator,
    samples: usize,
) -> Result<(usize, Vec<Measure>), DynamicsError> {
    let friction_coefficient = 0.6;
    let element = ContactElement {
        springs: Vec::new(),
        area: 1e-6,
        friction_coefficient,
        law: FrictionLaw::default(),
        sliders: vec![Slider {
            normal_load: exact.contact.limit / friction_coefficient,
            gap: 0.0,
            tangential_stiffness: exact.contact.stiffness,
            normal_stiffness: 3.5e7,
        }],
    };
    let oscillator = Oscillator {
        mass: [exact.mass; 3],
        damping: [exact.damping; 3],
        stiffness: [exact.stiffness; 3],
        element: element.clone(),
    };
    let vibration = Vibration {
        model: oscillator.model()?,
        loads: vec![Oscillator::load(0, 1.0, 0.0)],
        response_port: 0,
        harmonics: Harmonics::up_to(1),
        settings: Settings {
            samples,
            ..Settings::default()
        },
        range: (4000.0, 7500.0),
        points: None,
        gauge: Default::default(),
        journal: Default::default(),
        inertial_loads: Vec::new(),
    };
    let backbone = vibration.backbone(vibration.balance(vec![element])?, LEVELS)?;
    let points = &backbone.points;
    let compared = |quantity, unit, found: &dyn Fn(usize) -> f64, theirs: &dyn Fn(f64) -> f64| {
        let found: Vec<f64> = (0..points.len()).map(found).collect();
        let theirs: Vec<f64> = points.iter().map(|p| theirs(p.amplitude)).collect();
        Measure::field(quantity, unit, &found, &theirs)
    };
    let measures = vec![
        compared("force", "N", &|k| points[k].force, &|amplitude| {
            exact.resonant_force(amplitude)
        }),
        compared("frequency", "Hz", &|k| points[k].frequency, &|amplitude| {
            exact.backbone(amplitude) / TAU
        }),
        compared(
            "damping ratio",
            "1",
            &|k| points[k].damping_ratio,
            &|amplitude| exact.damping_ratio(amplitude),
        ),
    ];
    Ok((points.len(), measures))
}
