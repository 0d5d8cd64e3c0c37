//! Harmonic balance against time integration of the same oscillators: the average-acceleration scheme with a return mapping of
//! its own, marched until the transient is gone.

use fretwear::dynamics::{
    ContactElement, FrictionLaw, HarmonicBalance, Harmonics, Oscillator, Response, Settings,
};

use super::{CubicSpring, balance, drive, oscillator};

/// Force and tangent of a contact at displacement u, given what it remembers.
pub trait Contact {
    fn force(&self, u: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]);
    fn remember(&mut self, u: [f64; 3]);
}

/// A contact element that remembers where its sliders are.
pub struct Friction<'a> {
    element: &'a ContactElement,
    positions: Vec<[f64; 2]>,
}

impl Friction<'_> {
    pub fn of(element: &ContactElement) -> Friction<'_> {
        Friction {
            element,
            positions: vec![[0.0; 2]; element.sliders.len()],
        }
    }

    /// Of slider `k`.
    fn evaluate(&self, k: usize, u: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let (e, slider) = (&self.element.sliders[k], self.positions[k]);
        let (kt, kn, mu) = (
            e.tangential_stiffness,
            e.normal_stiffness,
            self.element.friction_coefficient,
        );
        let normal = e.normal_load + kn * (u[2] - e.gap);
        if normal <= 0.0 {
            return ([0.0, 0.0, -e.normal_load], [[0.0; 3]; 3]);
        }
        let mut force = [
            kt * (u[0] - slider[0]),
            kt * (u[1] - slider[1]),
            normal - e.normal_load,
        ];
        let mut tangent = [[kt, 0.0, 0.0], [0.0, kt, 0.0], [0.0, 0.0, kn]];
        let limit = mu * normal;
        match self.element.law {
            FrictionLaw::Cone => {
                let size = (force[0] * force[0] + force[1] * force[1]).sqrt();
                if size > limit {
                    let t = [force[0] / size, force[1] / size];
                    for i in 0..2 {
                        for j in 0..2 {
                            let identity = if i == j { 1.0 } else { 0.0 };
                            tangent[i][j] = kt * limit / size * (identity - t[i] * t[j]);
                        }
                        tangent[i][2] = mu * kn * t[i];
                        force[i] = limit * t[i];
                    }
                }
            }
            FrictionLaw::Box => {
                for i in 0..2 {
                    if force[i].abs() > limit {
                        let sign = force[i].signum();
                        force[i] = sign * limit;
                        tangent[i] = [0.0, 0.0, sign * mu * kn];
                    }
                }
            }
        }
        (force, tangent)
    }
}

impl Contact for Friction<'_> {
    fn force(&self, u: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let (mut force, mut tangent) = ([0.0; 3], [[0.0; 3]; 3]);
        for k in 0..self.positions.len() {
            let (own, slope) = self.evaluate(k, u);
            for i in 0..3 {
                force[i] += own[i];
                for j in 0..3 {
                    tangent[i][j] += slope[i][j];
                }
            }
        }
        (force, tangent)
    }

    fn remember(&mut self, u: [f64; 3]) {
        for (k, slider) in self.element.sliders.iter().enumerate() {
            let (force, _) = self.evaluate(k, u);
            let kt = slider.tangential_stiffness;
            self.positions[k] = [u[0] - force[0] / kt, u[1] - force[1] / kt];
        }
    }
}

struct Cubic(f64);

impl Contact for Cubic {
    fn force(&self, u: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let mut tangent = [[0.0; 3]; 3];
        tangent[0][0] = 3.0 * self.0 * u[0] * u[0];
        ([self.0 * u[0].powi(3), 0.0, 0.0], tangent)
    }

    fn remember(&mut self, _: [f64; 3]) {}
}

/// Displacements over the last of `periods` cycles of `steps` each, and the change from the cycle before.
pub fn integrate(
    oscillator: &Oscillator,
    contact: &mut dyn Contact,
    load: impl Fn(f64) -> [f64; 3],
    omega: f64,
    (periods, steps): (usize, usize),
) -> (Vec<[f64; 3]>, f64) {
    let h = 2.0 * std::f64::consts::PI / omega / steps as f64;
    let (mut u, mut v) = ([0.0; 3], [0.0; 3]);
    let start = load(0.0);
    let mut a = [0, 1, 2].map(|d| start[d] / oscillator.mass[d]);
    let mut cycles = [vec![[0.0; 3]; steps], vec![[0.0; 3]; steps]];
    for step in 0..periods * steps {
        let f = load((step + 1) as f64 * h);
        let mut next = u;
        for _ in 0..50 {
            let (force, tangent) = contact.force(next);
            let mut matrix = tangent;
            let mut residual = [0.0; 3];
            for d in 0..3 {
                let acceleration = 4.0 / (h * h) * (next[d] - u[d]) - 4.0 / h * v[d] - a[d];
                let velocity = 2.0 / h * (next[d] - u[d]) - v[d];
                residual[d] = oscillator.mass[d] * acceleration
                    + oscillator.damping[d] * velocity
                    + oscillator.stiffness[d] * next[d]
                    + force[d]
                    - f[d];
                matrix[d][d] += 4.0 / (h * h) * oscillator.mass[d]
                    + 2.0 / h * oscillator.damping[d]
                    + oscillator.stiffness[d];
            }
            let change = solve(matrix, residual);
            for d in 0..3 {
                next[d] -= change[d];
            }
            if change.iter().all(|c| c.abs() < 1e-18) {
                break;
            }
        }
        contact.remember(next);
        for d in 0..3 {
            let velocity = 2.0 / h * (next[d] - u[d]) - v[d];
            a[d] = 4.0 / (h * h) * (next[d] - u[d]) - 4.0 / h * v[d] - a[d];
            v[d] = velocity;
        }
        u = next;
        cycles[(step / steps) % 2][(step + 1) % steps] = u;
    }
    let pairs = cycles[0].iter().zip(&cycles[1]);
    let change = pairs.fold(0.0_f64, |worst, (a, b)| {
        (0..3).fold(worst, |w, d| w.max((a[d] - b[d]).abs()))
    });
    (cycles[(periods - 1) % 2].clone(), change)
}

fn solve(mut m: [[f64; 3]; 3], mut r: [f64; 3]) -> [f64; 3] {
    // The mass is on the diagonal: no exchanges are needed.
    for k in 0..3 {
        for i in k + 1..3 {
            let factor = m[i][k] / m[k][k];
            for j in k..3 {
                m[i][j] -= factor * m[k][j];
            }
            r[i] -= factor * r[k];
        }
    }
    for i in (0..3).rev() {
        for j in i + 1..3 {
            r[i] -= m[i][j] * r[j];
        }
        r[i] /= m[i][i];
    }
    r
}

/// Largest difference of a response from samples over the cycle, relative to the largest displacement, without the means.
pub fn error(harmonics: &Harmonics, response: &Response, samples: &[[f64; 3]]) -> f64 {
    let n = harmonics.coefficients();
    let mean = |d: usize| samples.iter().map(|s| s[d]).sum::<f64>() / samples.len() as f64;
    let means = [mean(0), mean(1), mean(2)];
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for (j, sample) in samples.iter().enumerate() {
        let basis = harmonics.basis(2.0 * std::f64::consts::PI * j as f64 / samples.len() as f64);
        for d in 0..3 {
            let row = &response.displacement[d * n..][..n];
            let value: f64 = basis[1..].iter().zip(&row[1..]).map(|(a, b)| a * b).sum();
            worst = worst.max((value - (sample[d] - means[d])).abs());
            largest = largest.max((sample[d] - means[d]).abs());
        }
    }
    worst / largest
}

#[test]
fn jenkins_oscillator() {
    for law in [FrictionLaw::Cone, FrictionLaw::Box] {
        let oscillator = oscillator(law);
        let omega = 5800.0;
        let force = 260.0;
        let mut friction = Friction::of(&oscillator.element);
        let (samples, change) = integrate(
            &oscillator,
            &mut friction,
            |t| [force * (omega * t).cos(), 0.0, 0.0],
            omega,
            (220, 4000),
        );
        assert!(change < 1e-13, "transient {change}");
        let mut errors = Vec::new();
        for highest in [1, 3, 5, 9, 15] {
            let settings = Settings {
                samples: 2048,
                ..Settings::default()
            };
            let balance = balance(&oscillator, highest, &drive(force), settings);
            let response = balance.solve(omega, None).unwrap_or_else(|e| panic!("{e}"));
            assert!(response.energy.friction > 0.3 * response.energy.input);
            assert!(
                response.energy.imbalance() < 1e-9,
                "{}",
                response.energy.imbalance()
            );
            errors.push(error(balance.harmonics(), &response, &samples));
        }
        println!("Jenkins oscillator, {law:?}: {errors:?}");
        assert!(
            errors.windows(2).all(|pair| pair[1] < pair[0]),
            "{errors:?}"
        );
        assert!(
            errors[4] < 2e-5 && errors[0] > 20.0 * errors[4],
            "{errors:?}"
        );
    }
}

#[test]
fn orbital_motion_with_varying_normal_load_and_with_separation() {
    // (force along n, whether it lifts off)
    for (normal, lifts) in [(60.0, false), (330.0, true)] {
        for law in [FrictionLaw::Cone, FrictionLaw::Box] {
            let mut oscillator = oscillator(law);
            oscillator.damping = [700.0, 800.0, 900.0];
            let omega = 5600.0;
            let loads = [
                Oscillator::load(0, 230.0, 0.0),
                Oscillator::load(1, 260.0, -1.3),
                Oscillator::load(2, normal, 0.6),
            ];
            let value = |t: f64| {
                [
                    230.0 * (omega * t).cos(),
                    260.0 * (omega * t - 1.3).cos(),
                    normal * (omega * t + 0.6).cos(),
                ]
            };
            let mut friction = Friction::of(&oscillator.element);
            let (samples, change) =
                integrate(&oscillator, &mut friction, value, omega, (130, 20_000));
            assert!(change < 1e-12, "transient {change}");
            let mut errors = Vec::new();
            for highest in [1, 3, 7, 15] {
                let settings = Settings {
                    samples: 256,
                    ..Settings::default()
                };
                let balance = balance(&oscillator, highest, &loads, settings);
                let response = balance.solve(omega, None).unwrap_or_else(|e| panic!("{e}"));
                assert!(
                    response.energy.imbalance() < 1e-9,
                    "{}",
                    response.energy.imbalance()
                );
                let cycle = &balance.element_cycles(&response, balance.sampling())[0];
                assert_eq!(cycle.force.iter().any(|f| f[2] == 0.0), lifts, "{highest}");
                errors.push(error(balance.harmonics(), &response, &samples));
            }
            println!("orbit, {law:?}, lifts {lifts}: {errors:?}");
            assert!(
                errors.windows(2).all(|pair| pair[1] < pair[0]),
                "{errors:?}"
            );
            assert!(errors[3] < 1e-4, "{errors:?}");
        }
    }
}

#[test]
fn cone_and_box_differ_on_an_orbit() {
    let amplitude = |law| {
        let oscillator = oscillator(law);
        let loads = [
            Oscillator::load(0, 230.0, 0.0),
            Oscillator::load(1, 260.0, -1.3),
        ];
        let balance = balance(&oscillator, 5, &loads, Settings::default());
        let response = balance
            .solve(5600.0, None)
            .unwrap_or_else(|e| panic!("{e}"));
        balance.amplitude(&response, 0).expect("port 0").0
    };
    let (cone, square) = (amplitude(FrictionLaw::Cone), amplitude(FrictionLaw::Box));
    let share = (cone - square).abs() / cone;
    println!("cone {cone:.4e} m, box {square:.4e} m: {share:.3}");
    assert!(share > 0.02 && share < 0.4, "{share}");
}

#[test]
fn duffing_oscillator() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping = [600.0; 3];
    let cubic = 1.2e17;
    let omega = 4700.0;
    let force = 120.0;
    let (samples, change) = integrate(
        &oscillator,
        &mut Cubic(cubic),
        |t| [force * (omega * t).cos(), 0.0, 0.0],
        omega,
        (200, 8000),
    );
    assert!(change < 1e-12, "transient {change}");
    let mut errors = Vec::new();
    for highest in [1, 3, 5, 7] {
        let model = oscillator.model().expect("right");
        let balance = HarmonicBalance::new(
            &model,
            vec![CubicSpring(cubic)],
            Harmonics::up_to(highest),
            drive(force),
            Settings::default(),
        )
        .expect("right");
        let response = balance.solve(omega, None).unwrap_or_else(|e| panic!("{e}"));
        errors.push(error(balance.harmonics(), &response, &samples));
    }
    println!("Duffing: {errors:?}");
    assert!(
        errors[1] < 0.2 * errors[0] && errors[3] < 1e-5,
        "{errors:?}"
    );
}
