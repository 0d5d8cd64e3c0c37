//! Published backbones of one mode of the Brake–Reuss beam with its measured faces, computed by other authors by extended periodic motion.
//! The test fits a bank of sliders and a linear oscillator to the published frequency and damping ratio over amplitude, and compares the
//! backbone that the program computes for this bank. `FRETWEAR_REAL_DATA` names the folder with `brake_reuss`; without it the test skips
//! itself.
//!
//! The fit contains no model of the joint. The test shows that one bank of sliders describes frequency and damping of a real joint model
//! (Masing's rule), and that the program computes the backbone of such a bank according to its describing function.

use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

use fretwear::dynamics::{ContactElement, FrictionLaw, LoadLevels, Oscillator, Slider, Vibration};
use fretwear::reference::Jenkins;

/// Number of sliders. Their yield displacements, as modal amplitudes, are spaced twelve per decade over the range of the data and one
/// decade beyond.
const SLIDERS: usize = 45;
/// Number of sweeps of the fit, which converges much earlier.
const SWEEPS: usize = 20_000;
/// Errors of equal weight: relative error of the squared frequency and of the damping ratio.
const WEIGHTS: [f64; 2] = [1e-3, 3e-2];

/// Published curve: modal amplitude \[kg^½ m\], angular frequency \[rad/s\], damping ratio.
struct Curve {
    amplitude: Vec<f64>,
    omega: Vec<f64>,
    damping: Vec<f64>,
}

fn curve(name: &str) -> Option<Curve> {
    let folder = PathBuf::from(std::env::var_os("FRETWEAR_REAL_DATA")?);
    let path = folder.join("brake_reuss").join(name);
    let text = std::fs::read_to_string(&path).ok()?;
    let row = |key: &str| -> Vec<f64> {
        let line = text.lines().find(|line| line.starts_with(key)).expect(key);
        let list = line.split(['[', ']']).nth(1).expect("a list");
        let numbers = list.split(',').map(|number| number.trim().parse());
        numbers.collect::<Result<_, _>>().expect("numbers")
    };
    Some(Curve {
        amplitude: row("modal_amplitude"),
        omega: row("frequency_rad_per_s"),
        damping: row("damping_factor_frac_crit"),
    })
}

/// Unit mass on a spring, a dashpot and a bank of Jenkins elements.
struct Bank {
    stiffness: f64,
    damping: f64,
    sliders: Vec<Jenkins>,
}

impl Bank {
    fn squared(&self, amplitude: f64) -> f64 {
        let of = |slider: &Jenkins| slider.coefficients(amplitude, 1).0 / amplitude;
        self.stiffness + self.sliders.iter().map(of).sum::<f64>()
    }

    fn ratio(&self, amplitude: f64) -> f64 {
        let squared = self.squared(amplitude);
        let friction = self
            .sliders
            .iter()
            .map(|s| s.dissipated_energy(amplitude))
            .sum::<f64>();
        let viscous = PI * self.damping * squared.sqrt() * amplitude * amplitude;
        (friction + viscous) / (2.0 * PI * squared * amplitude * amplitude)
    }

    /// Least squares fit with stiffnesses ≥ 0, one coordinate at a time. The dashpot follows from the damping at the smallest amplitude.
    fn fitted(curve: &Curve) -> Bank {
        let (least, most) = (
            curve.amplitude[0],
            curve.amplitude[curve.amplitude.len() - 1],
        );
        let onset = |k: usize| least * (10.0 * most / least).powf(k as f64 / (SLIDERS - 1) as f64);
        let unit = |k: usize| Jenkins {
            stiffness: 1.0,
            limit: onset(k),
        };
        let points = curve.amplitude.len();
        let damping = 2.0 * curve.damping[0] * curve.omega[0];
        let mut columns = vec![vec![0.0; 2 * points]; SLIDERS + 1];
        let mut right = vec![0.0; 2 * points];
        for p in 0..points {
            let (a, omega) = (curve.amplitude[p], curve.omega[p]);
            let squared = omega * omega;
            let energy = 2.0 * PI * squared * a * a;
            columns[SLIDERS][p] = 1.0 / (squared * WEIGHTS[0]);
            right[p] = 1.0 / WEIGHTS[0];
            right[points + p] = (1.0 - damping / (2.0 * curve.damping[p] * omega)) / WEIGHTS[1];
            for (k, column) in columns.iter_mut().enumerate().take(SLIDERS) {
                let slider = unit(k);
                column[p] = slider.coefficients(a, 1).0 / a / (squared * WEIGHTS[0]);
                column[points + p] =
                    slider.dissipated_energy(a) / (energy * curve.damping[p] * WEIGHTS[1]);
            }
        }
        let mut found = vec![0.0; SLIDERS + 1];
        let mut left = right;
        for _ in 0..SWEEPS {
            for (value, column) in found.iter_mut().zip(&columns) {
                let size: f64 = column.iter().map(|c| c * c).sum();
                let slope: f64 = column.iter().zip(&left).map(|(c, r)| c * r).sum();
                let new = f64::max(*value + slope / size, 0.0);
                left.iter_mut()
                    .zip(column)
                    .for_each(|(r, c)| *r -= (new - *value) * c);
                *value = new;
            }
        }
        let sliders = (0..SLIDERS).filter(|k| found[*k] > 0.0);
        Bank {
            stiffness: found[SLIDERS],
            damping,
            sliders: sliders
                .map(|k| Jenkins {
                    stiffness: found[k],
                    limit: found[k] * onset(k),
                })
                .collect(),
        }
    }

    fn vibration(&self, samples: usize, range: (f64, f64)) -> (Vibration, ContactElement) {
        let slider = |slider: &Jenkins| Slider {
            normal_load: slider.limit,
            gap: 0.0,
            tangential_stiffness: slider.stiffness,
            normal_stiffness: slider.stiffness,
        };
        let element = ContactElement {
            springs: Vec::new(),
            area: 1.0,
            friction_coefficient: 1.0,
            law: FrictionLaw::Cone,
            sliders: self.sliders.iter().map(slider).collect(),
        };
        let oscillator = Oscillator {
            mass: [1.0; 3],
            damping: [self.damping; 3],
            stiffness: [self.stiffness; 3],
            element: element.clone(),
        };
        let vibration = Vibration {
            settings: super::samples(samples),
            ..super::vibration(&oscillator, 1, super::drive(1.0), range)
        };
        (vibration, element)
    }
}

#[test]
fn a_bank_of_sliders_has_the_published_backbones() {
    for name in ["tmdsimpy_brb_epmc_flat.yaml", "tmdsimpy_brb_epmc_meso.yaml"] {
        let Some(curve) = curve(name) else {
            println!(
                "skipped: the folder of FRETWEAR_REAL_DATA does not contain brake_reuss/{name}"
            );
            return;
        };
        let bank = Bank::fitted(&curve);
        let last = curve.amplitude.len() - 1;
        let range = (0.8 * curve.omega[last], 1.1 * curve.omega[0]);
        let (vibration, element) = bank.vibration(1024, range);
        // Forces of the modal phase resonances at both ends of the curve.
        let force = |k: usize| 2.0 * curve.damping[k] * curve.omega[k].powi(2) * curve.amplitude[k];
        let levels = LoadLevels {
            from: 0.8 * force(0),
            to: 1.2 * force(last),
            count: None,
        };
        let balance = vibration.balance(vec![element]).expect("valid");
        let found = vibration.backbone(balance, levels).expect("a backbone");
        let [mut frequency, mut damping] = [0.0_f64; 2];
        for point in &found.points {
            let [omega, ratio] = [
                bank.squared(point.amplitude).sqrt(),
                bank.ratio(point.amplitude),
            ];
            assert!(
                (point.frequency * TAU / omega - 1.0).abs() < 1e-5,
                "{point:?}"
            );
            assert!(
                (point.damping_ratio / ratio - 1.0).abs() < 1e-3,
                "{point:?}"
            );
        }
        for k in 0..=last {
            let pair = found
                .points
                .windows(2)
                .find(|pair| (pair[0].amplitude..pair[1].amplitude).contains(&curve.amplitude[k]));
            let [low, high] = pair.expect("an amplitude of the backbone") else {
                unreachable!()
            };
            let share =
                (curve.amplitude[k] / low.amplitude).ln() / (high.amplitude / low.amplitude).ln();
            let between = |low: f64, high: f64| low * (high / low).powf(share);
            let off = between(low.frequency, high.frequency) * TAU / curve.omega[k] - 1.0;
            let ratio = between(low.damping_ratio, high.damping_ratio) / curve.damping[k] - 1.0;
            println!(
                "{name} {:.3e}: frequency {off:+.1e}, damping {ratio:+.3}",
                curve.amplitude[k]
            );
            frequency = frequency.max(off.abs());
            damping = damping.max(ratio.abs());
        }
        println!(
            "{name}: {} sliders, {} points, {} solves; frequency within {frequency:.1e}, damping within {damping:.3}",
            bank.sliders.len(),
            found.points.len(),
            found.solves
        );
        assert!(frequency < 1.5e-3, "{name}: {frequency}");
        assert!(damping < 0.06, "{name}: {damping}");
    }
}
