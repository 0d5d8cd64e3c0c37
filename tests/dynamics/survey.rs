//! Resonances over a whole range: all of them, the strongest, and none that a row of the forced response is above.

use std::f64::consts::{PI, TAU};

use super::changed;
use fretwear::dynamics::forced_response::FoundBy;
use fretwear::dynamics::{
    CandidateKind, ContactElement, DynamicsError, FrictionLaw, Harmonics, Load, Oscillator,
    Settings, Slider, Vibration,
};

pub fn vibration(
    oscillator: &Oscillator,
    loads: Vec<Load>,
    response_port: usize,
    range: (f64, f64),
) -> Vibration {
    Vibration {
        model: oscillator.model().expect("an oscillator"),
        loads,
        response_port,
        harmonics: Harmonics::up_to(5),
        settings: Settings {
            by_events: true,
            samples: 256,
            ..Settings::default()
        },
        range: (TAU * range.0, TAU * range.1),
        points: None,
        gauge: Default::default(),
        journal: Default::default(),
        surveyed: Default::default(),
        inertial_loads: Vec::new(),
    }
}

fn element(normal_load: f64, kt: f64, kn: f64) -> ContactElement {
    ContactElement {
        springs: Vec::new(),
        area: 0.0,
        friction_coefficient: 0.3,
        law: FrictionLaw::Cone,
        sliders: vec![Slider {
            normal_load,
            gap: 0.0,
            tangential_stiffness: kt,
            normal_stiffness: kn,
        }],
    }
}

fn light(element: ContactElement) -> Oscillator {
    Oscillator {
        mass: [1.0, 1.0, 1.0],
        damping: [2.0, 2.0, 2.0],
        stiffness: [4e4, 4e4, 4e4],
        element,
    }
}

fn top(vibration: &Vibration, oscillator: &Oscillator) -> f64 {
    let elements = vec![oscillator.element.clone()];
    let resolved = vibration
        .resolve(elements, None, None)
        .expect("a resonance");
    let peak = resolved.resonance.peak_amplitude;
    let points = vibration
        .forced_response(resolved.balance)
        .expect("a forced response");
    for point in &points {
        let response = point.response.as_ref().expect("all are found");
        assert!(
            response.amplitude <= peak * (1.0 + 1e-9),
            "{} Hz",
            point.frequency
        );
        let energy = response.energy;
        assert!(energy.friction >= -1e-9 * energy.input.abs(), "{energy:?}");
    }
    peak
}

/// Loads on one port in one harmonic add up, in amplitude and phase; the drive is their sum.
#[test]
fn loads_on_a_port_are_one() {
    let oscillator = light(element(20.0, 3e4, 5e4));
    let range = (20.0, 60.0);
    let both = vec![
        Oscillator::load(0, 4.0, 0.0),
        Oscillator::load(0, 4.0, PI / 2.0),
    ];
    let one = vec![Oscillator::load(0, 4.0 * f64::sqrt(2.0), PI / 4.0)];
    let peaks = [both, one].map(|loads| {
        let vibration = vibration(&oscillator, loads, 0, range);
        let elements = vec![oscillator.element.clone()];
        let resolved = vibration
            .resolve(elements, None, None)
            .expect("a resonance");
        let resonance = resolved.resonance;
        (resonance.peak_amplitude, resonance.in_force().omega)
    });
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    assert!(same(peaks[0].0, peaks[1].0), "{peaks:?}");
    assert!(same(peaks[0].1, peaks[1].1), "{peaks:?}");

    let against = vec![Oscillator::load(0, 4.0, 0.0), Oscillator::load(0, 8.0, PI)];
    let vibration_against = vibration(&oscillator, against, 0, range);
    let alone = vibration(&oscillator, vec![Oscillator::load(0, 4.0, 0.0)], 0, range);
    let peaks = [vibration_against, alone].map(|vibration| top(&vibration, &oscillator));
    assert!(same(peaks[0], peaks[1]), "{peaks:?}");
}

#[test]
fn loads_that_cancel_are_no_drive() {
    let oscillator = light(element(20.0, 3e4, 5e4));
    let loads = vec![
        Oscillator::load(0, 4.0, 0.3),
        Oscillator::load(0, 4.0, 0.3 + PI),
    ];
    let vibration = vibration(&oscillator, loads, 0, (20.0, 60.0));
    let balance = vibration
        .balance(vec![oscillator.element.clone()])
        .expect("a balance");
    assert!(balance.drive().is_none());
    assert!(matches!(
        balance.phase_resonance(vibration.range, None),
        Err(DynamicsError::OutOfRange { .. })
    ));
}

/// A mass that bounces on its contact has a main resonance, and others where a harmonic is resonant.
#[test]
fn strongest_resonance_is_chosen() {
    let oscillator = Oscillator {
        damping: [0.6; 3],
        ..light(element(1.0, 3e4, 9e4))
    };
    let loads = vec![Oscillator::load(2, 6.0, 0.0), Oscillator::load(0, 1.0, 0.5)];
    let vibration = vibration(&oscillator, loads, 2, (8.0, 90.0));
    let elements = vec![oscillator.element.clone()];
    let resolved = vibration
        .resolve(elements, None, None)
        .expect("a resonance");
    let resonance = &resolved.resonance;
    let peaks: Vec<f64> = resonance
        .candidates
        .iter()
        .filter(|c| c.kind == CandidateKind::Peak)
        .map(|c| c.amplitude)
        .collect();
    assert!(peaks.len() > 1, "{peaks:?}");
    assert!(peaks.iter().all(|peak| *peak <= resonance.peak_amplitude));
    top(&vibration, &oscillator);
    let at_points = Vibration {
        points: Some(40),
        ..vibration.clone()
    };
    top(&at_points, &oscillator);
    // The multipliers of the motion in time say that it stays.
    let chosen = resonance.candidates.first().expect("candidates");
    assert!(chosen.multiplier.is_some());
}

/// Without preload the problem is homogeneous in the load; it has responses all the same.
#[test]
fn no_preload_has_a_response() {
    let oscillator = light(element(0.0, 3e4, 5e4));
    let loads = vec![Oscillator::load(0, 4.0, 0.0), Oscillator::load(2, 6.0, 1.0)];
    let vibration = Vibration {
        points: Some(31),
        ..vibration(&oscillator, loads, 0, (15.0, 60.0))
    };
    let balance = vibration
        .balance(vec![oscillator.element.clone()])
        .expect("a balance");
    let points = vibration.forced_response(balance).expect("points");
    assert_eq!(points.len(), 31);
    let found = points
        .iter()
        .filter(|point| point.response.is_some())
        .count();
    assert!(found >= 29, "{found} of 31");
    for point in points {
        match point.found_by {
            FoundBy::Balance => assert!(point.residual <= 1e-6, "{point:?}"),
            FoundBy::Time => assert!(point.residual <= 1e-7, "{point:?}"),
            FoundBy::Unphysical
            | FoundBy::NotPeriodic(_)
            | FoundBy::NotSettled
            | FoundBy::Nothing => {
                assert!(point.response.is_none())
            }
        }
    }
}

#[test]
fn a_load_across_the_response_is_not_the_drive() {
    let mut oscillator = light(element(100.0, 1e5, 1e5));
    oscillator.stiffness = [1e6, 1e6, 1e8];
    let load = |port, cosine| Load {
        port,
        harmonic: 1,
        cosine,
        sine: 0.0,
    };
    let (across, along) = (load(2, 1.0), load(0, 20.0));
    let of = |loads| {
        let vibration = vibration(&oscillator, loads, 0, (100.0, 250.0));
        let elements = vec![oscillator.element.clone()];
        let resolved = vibration.resolve(elements, None, None);
        let resonance = resolved.expect("a peak").resonance;
        assert!(resonance.phase.is_some());
        (resonance.peak_frequency, resonance.peak_amplitude)
    };
    let (first, second) = (of(vec![across, along]), of(vec![along, across]));
    assert!(
        (first.0 / second.0 - 1.0).abs() < 1e-9,
        "{first:?} {second:?}"
    );
    assert!(
        (first.1 / second.1 - 1.0).abs() < 1e-9,
        "{first:?} {second:?}"
    );
}

#[test]
fn without_a_phase_resonance_the_peak_stays() {
    // Above the resonance all displacements are behind the drive by more than a quarter of a cycle.
    let oscillator = light(element(100.0, 1e5, 1e5));
    let vibration = vibration(
        &oscillator,
        vec![Oscillator::load(0, 1.0, 0.0)],
        0,
        (90.0, 120.0),
    );
    let elements = vec![oscillator.element.clone()];
    let resolved = vibration.resolve(elements, None, None).expect("a peak");
    let resonance = resolved.resonance;
    assert!(resonance.phase.is_none());
    assert!((resonance.peak_frequency / 90.0 - 1.0).abs() < 1e-9);
    assert_eq!(resonance.in_force(), &resonance.peak);
}

/// By integration alone a forced response is that of the balance, within its own error and that of the harmonics.
#[test]
fn a_forced_response_in_time_is_that_of_the_balance() {
    /// What harmonics up to 9 leave of the amplitude.
    const HARMONICS: f64 = 2e-3;
    let mut oscillator = light(element(100.0, 1e5, 1e5));
    oscillator.stiffness = [1e6, 1e6, 1e8];
    let loads = vec![Oscillator::load(0, 20.0, 0.0)];
    let vibration = Vibration {
        points: Some(7),
        harmonics: Harmonics::up_to(9),
        ..vibration(&oscillator, loads, 0, (100.0, 250.0))
    };
    let of = || {
        let balance = vibration.balance(vec![oscillator.element.clone()]);
        balance.expect("a balance")
    };
    let ours = vibration.forced_response(of()).expect("points");
    let theirs = vibration.forced_response_in_time(&of()).expect("points");
    assert_eq!(ours.len(), theirs.len());
    for (ours, theirs) in ours.iter().zip(&theirs) {
        assert_eq!(theirs.found_by, FoundBy::Time, "{theirs:?}");
        let (balance, time) = (ours.response.as_ref(), theirs.response.as_ref());
        let (balance, time) = (balance.expect("a response"), time.expect("a motion"));
        let error = time.error.expect("an error");
        assert!(error < 1e-5, "{error:e} at {} Hz", theirs.frequency);
        let apart = (balance.amplitude / time.amplitude - 1.0).abs();
        assert!(
            apart < HARMONICS + error,
            "{apart:e} at {} Hz",
            theirs.frequency
        );
        assert!((balance.phase_lag - time.phase_lag).abs() < HARMONICS);
    }
}

/// A force of the second harmonic along z lifts the contact off at its own resonance, of which the response along x shows nothing: the branch
/// bends down to where the freed x resonates, far above what x does while it sticks.
#[test]
fn a_resonance_along_another_axis_is_not_stepped_over() {
    /// How far the freed motion is above the stuck one at least; integration in time, with a program of its own, has 14 times.
    const ABOVE: f64 = 10.0;
    /// What harmonics up to 15 leave of a motion with lift-off against the one in time.
    const IN_TIME: f64 = 0.05;
    let oscillator = Oscillator {
        mass: [0.7287; 3],
        damping: [0.006753; 3],
        stiffness: [13254.0; 3],
        element: ContactElement {
            friction_coefficient: 0.6915,
            ..element(13.885, 315_447.0, 109_365.0)
        },
    };
    let (along_z, phase) = (1.5942, -148.14 * PI / 180.0);
    let loads = vec![
        Oscillator::load(0, 1.5159, 0.0),
        Load {
            harmonic: 2,
            ..Oscillator::load(2, along_z, phase)
        },
    ];
    let mut vibration = vibration(&oscillator, loads, 0, (10.73, 160.3));
    vibration.harmonics = Harmonics::up_to(15);
    let balance = vibration
        .balance(vec![oscillator.element.clone()])
        .expect("a balance");
    let resonance = vibration.resonance(&balance, None).expect("a resonance");
    let stuck = resonance
        .candidates
        .iter()
        .find(|candidate| candidate.response.frequency() > 90.0)
        .expect("the resonance of the stuck contact");
    let freed = resonance.candidates.iter().find(|candidate| {
        let in_time = candidate.amplitude_in_time;
        in_time.is_some_and(|size| (size / candidate.amplitude - 1.0).abs() < IN_TIME)
            && candidate.amplitude > ABOVE * stuck.amplitude
    });
    let told = resonance.candidates.iter().map(|c| {
        let frequency = c.response.frequency();
        format!(
            "{frequency:.3} Hz {:.3e} m, in time {:?}",
            c.amplitude, c.amplitude_in_time
        )
    });
    let freed = freed.unwrap_or_else(|| panic!("{:?}", told.collect::<Vec<String>>()));
    assert!(freed.response.frequency() < 32.0);
    assert!(resonance.peak_amplitude >= freed.amplitude);
}

/// A contact that is thousands of times stiffer than its spring and opens: twice as many harmonics do not lead to the same peak, and the
/// motions in time say how far off it is.
#[test]
fn an_error_bar_holds_the_peak_in_time() {
    // By `tests/dynamics/time_integration.py`.
    const IN_TIME: f64 = 9.395_205_904e-6;
    const NARROW: f64 = 0.05;
    let oscillator = Oscillator {
        mass: [1.0, 1.0, 1.0],
        damping: [53.3972, 44.887, 41.6437],
        stiffness: [2.633_48e5, 1.860_95e5, 1.601_74e5],
        element: ContactElement {
            friction_coefficient: 0.715,
            ..element(26.4499, 1.316_53e8, 6.778_53e8)
        },
    };
    let constant = Load {
        port: 2,
        harmonic: 0,
        cosine: 0.213_575,
        sine: 0.0,
    };
    let loads = vec![Oscillator::load(2, 1.48002, 0.0), constant];
    let mut vibration = vibration(&oscillator, loads, 2, (44.2787, 5385.94));
    vibration.harmonics = Harmonics::up_to(15);
    let elements = vec![oscillator.element.clone()];
    let resolved = vibration
        .resolve(elements, None, None)
        .expect("a resonance");
    let bar = resolved.truncation.amplitude;
    let off = (resolved.resonance.peak_amplitude / IN_TIME - 1.0).abs();
    assert!((off..NARROW).contains(&bar), "{bar}, off by {off}");
}

/// A contact that is pressed together bounces on after a larger load, and while it is open the mass is at its resonance in the plane. From
/// rest neither a branch nor a motion in time leads there.
#[test]
fn an_error_bar_holds_a_motion_that_bounces_on() {
    // By `tests/dynamics/time_integration.py`: stable, and the highest that `drawn_oscillators.py` has found.
    const STABLE: f64 = 0.0844;
    const IN_TIME: f64 = 0.198_421_7;
    let oscillator = Oscillator {
        mass: [1.0; 3],
        damping: [3.31807, 3.72316, 2.42031],
        stiffness: [139_110.0, 175_150.0, 74_016.7],
        element: ContactElement {
            friction_coefficient: 0.567,
            law: FrictionLaw::Box,
            ..changed(&element(0.0, 142_347.0, 26_668_900.0), |slider| {
                slider.gap = 0.005_037_94;
            })
        },
    };
    let constant = Load {
        port: 2,
        harmonic: 0,
        cosine: 2041.96,
        sine: 0.0,
    };
    let loads = vec![
        Oscillator::load(0, 287.991, 12.4_f64.to_radians()),
        Oscillator::load(2, 889.05, 175.0_f64.to_radians()),
        constant,
    ];
    let vibration = vibration(&oscillator, loads, 0, (29.68, 126.654));
    let elements = vec![oscillator.element.clone()];
    let resolved = vibration
        .resolve(elements, None, None)
        .expect("a resonance");
    let highest = resolved.resonance.peak_amplitude * (1.0 + resolved.truncation.amplitude);
    assert!(highest >= IN_TIME, "{highest}");
    assert!(
        resolved.resonance.peak_amplitude > 0.1 * STABLE,
        "{} m, of what stays pressed together",
        resolved.resonance.peak_amplitude
    );
}

/// Far below the resonance of its closed contact, and pressed by more than the load takes off, a mass may bounce as high as damping allows.
#[test]
fn an_error_bar_holds_the_resonance_of_a_mass_that_bounces() {
    // From event to event in closed forms; at the balance of what the load supplies with what the damping takes.
    const BOUNCES: f64 = 3.6424e-3;
    const KNOWN: f64 = 0.2;
    let oscillator = Oscillator {
        mass: [1.0; 3],
        damping: [2.163_975; 3],
        stiffness: [1e6; 3],
        element: element(20.0, 2.134_245e7, 4.268_490_48e7),
    };
    let loads = vec![Oscillator::load(2, 16.369_053_9, 0.0)];
    let vibration = vibration(&oscillator, loads, 2, (63.662, 525.964));
    let elements = vec![oscillator.element.clone()];
    let resolved = vibration
        .resolve(elements, None, None)
        .expect("a resonance");
    let (peak, bar) = (
        resolved.resonance.peak_amplitude,
        resolved.truncation.amplitude,
    );
    let off = (peak / BOUNCES - 1.0).abs();
    assert!((off..KNOWN).contains(&bar), "{peak} m, {bar}, off by {off}");
}

/// With three harmonics the resonance of the stiff contact along x is the strongest. In time that of a contact that opens along z is: it is found on
/// the path of what bounces there, and the bar of the peak holds it.
#[test]
fn a_peak_along_x_of_a_contact_that_opens_along_z_is_found() {
    // By `tests/dynamics/time_integration.py`, at 506.96 Hz.
    const IN_TIME: f64 = 9.237_520_903e-8;
    // The climb to it ends when it has cost as much as it may, and the bar then says that the peak is not known.
    const CLIMBED: f64 = 0.005;
    let oscillator = Oscillator {
        mass: [1.17507, 2.95815, 0.937_408],
        damping: [9.65939, 15.7803, 9.15241],
        stiffness: [4.210_34e6, 4.463_69e6, 4.738_31e6],
        element: ContactElement {
            friction_coefficient: 0.53,
            ..element(61.1754, 7.412_96e8, 6.0739e6)
        },
    };
    let loads = vec![
        Oscillator::load(0, 3.40275, 0.0),
        Oscillator::load(2, 0.656_429, -117.0 * PI / 180.0),
    ];
    let mut vibration = vibration(&oscillator, loads, 0, (150.6, 6012.0));
    vibration.harmonics = Harmonics::new(&[0, 1, 3]).expect("harmonics");
    let elements = vec![oscillator.element.clone()];
    let resolved = vibration
        .resolve(elements, None, None)
        .expect("a resonance");
    let bar = resolved.truncation.amplitude;
    let off = (resolved.resonance.peak_amplitude / IN_TIME - 1.0).abs();
    assert!(off < CLIMBED, "{off}");
    assert!(bar > off, "{bar}, off by {off}");
}

/// A mass that chatters along z, some twenty times a period, in many ways at once: what was not seen beside the response with three harmonics is not
/// seen with the fifteen that these are extended to either, and the bar of the peak says so.
#[test]
fn what_a_survey_has_not_seen_is_not_known_with_more_harmonics() {
    // By `tests/dynamics/time_integration.py`, at 37.7187 Hz; the branches have 0.74 m.
    const IN_TIME: f64 = 0.992_652_548;
    const TOLERANCE: f64 = 0.005;
    let turn = |degrees: f64| degrees * PI / 180.0;
    let (mass, stiffness) = (
        [0.912_147, 0.415_949, 0.361_711],
        [51_231.6, 41_529.2, 117_581.0],
    );
    let damping = std::array::from_fn(|k| 2.0 * 0.001_178_57 * f64::sqrt(stiffness[k] * mass[k]));
    let oscillator = Oscillator {
        mass,
        damping,
        stiffness,
        element: ContactElement {
            friction_coefficient: 0.736,
            law: FrictionLaw::Box,
            ..element(72.8557, 348.385, 1.024_32e7)
        },
    };
    let loads = vec![
        Oscillator::load(0, 123.257, turn(-174.0)),
        Oscillator::load(1, 184.131, turn(171.0)),
        Oscillator::load(2, 100.624, turn(-103.0)),
        Load {
            port: 2,
            harmonic: 0,
            cosine: 12.7963,
            sine: 0.0,
        },
    ];
    let mut vibration = vibration(&oscillator, loads, 0, (13.484, 43.0997));
    vibration.harmonics = Harmonics::up_to(3);
    let elements = vec![oscillator.element.clone()];
    let resolved = vibration
        .resolve(elements, None, Some(TOLERANCE))
        .expect("a resonance");
    let (peak, bar) = (
        resolved.resonance.peak_amplitude,
        resolved.truncation.amplitude,
    );
    assert!(IN_TIME <= peak * (1.0 + bar), "{peak} m, bar {bar}");
}

/// The branch of a contact without preload, hundreds of times stiffer than the structure, runs into responses in which friction gives energy,
/// and is highest beside them.
#[test]
fn no_row_is_above_the_peak_where_a_branch_ends_in_what_is_no_response() {
    let oscillator = Oscillator {
        mass: [0.421_961, 1.57061, 0.511_751],
        damping: [0.048_411_2, 0.101_828, 0.034_178_7],
        stiffness: [3.584_86e6, 4.261_08e6, 1.473_35e6],
        element: ContactElement {
            friction_coefficient: 1.38,
            ..element(0.0, 1.637_14e8, 2.160_51e9)
        },
    };
    let turn = |degrees: f64| degrees * PI / 180.0;
    let loads = vec![
        Oscillator::load(0, 2.85722, turn(-174.0)),
        Oscillator::load(1, 0.369_463, turn(-67.4)),
        Oscillator::load(2, 7.69009, turn(61.5)),
        Load {
            port: 2,
            harmonic: 0,
            cosine: 2.30794,
            sine: 0.0,
        },
    ];
    let mut vibration = vibration(&oscillator, loads, 0, (231.9, 4753.6));
    vibration.harmonics = Harmonics::up_to(3);
    let resolved = vibration
        .resolve(vec![oscillator.element.clone()], None, None)
        .expect("a resonance");
    let peak = resolved.resonance.peak_amplitude;
    let rows = vibration.forced_response(resolved.balance).expect("rows");
    let amplitudes = rows.iter().filter_map(|row| row.response.as_ref());
    let highest = amplitudes.fold(0.0, |most: f64, row| most.max(row.amplitude));
    assert!(
        highest > 0.0 && peak >= highest * (1.0 - 1e-9),
        "{peak} below {highest}"
    );
}

/// A response point that nothing moves has no peak but rounding, which is said.
#[test]
fn what_nothing_moves_is_still() {
    let oscillator = light(element(20.0, 3e4, 5e4));
    for (port, is_still) in [(2, true), (0, false)] {
        let loads = vec![Oscillator::load(0, 4.0, 0.3)];
        let vibration = vibration(&oscillator, loads, port, (20.0, 60.0));
        let elements = vec![oscillator.element.clone()];
        let resolved = vibration
            .resolve(elements, None, None)
            .expect("a resonance");
        assert_eq!(resolved.resonance.is_still, is_still, "along {port}");
        assert_eq!(
            resolved.truncation.amplitude >= 1.0,
            is_still,
            "along {port}"
        );
    }
}

/// A forced response takes the survey of its resonance where there is one; another start of the program has none.
#[test]
fn a_survey_that_is_kept_is_the_one_that_is_made_again() {
    let oscillator = light(element(20.0, 3e4, 5e4));
    let loads = vec![Oscillator::load(0, 4.0, 0.0)];
    let first = vibration(&oscillator, loads, 0, (20.0, 60.0));
    let other = first.clone();
    let rows = |vibration: &Vibration, load: f64| {
        let balance = vibration.balance(vec![element(load, 3e4, 5e4)]);
        let points = vibration.forced_response(balance.expect("a balance"));
        points.expect("a forced response")
    };
    let made = rows(&first, 20.0);
    assert_eq!(rows(&first, 20.0), made);
    assert_eq!(rows(&other, 20.0), made);
    // Of other elements nothing is known, nor over another range.
    assert_ne!(rows(&first, 10.0), made);
    assert_eq!(rows(&first, 10.0), rows(&other, 10.0));
    let mut narrower = first;
    narrower.range.1 *= 0.9;
    assert_ne!(rows(&narrower, 20.0), made);
}
