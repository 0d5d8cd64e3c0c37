//! Tests of harmonic balance against time integration of the same oscillators: the average-acceleration method with an independent return
//! mapping, integrated until the transient has decayed.

use fretwear::dynamics::{
    BalanceSettings, ContactElement, FrictionLaw, HarmonicBalance, Harmonics, Load, Oscillator,
    Response, Spring,
};

use super::bank::bank;
use super::{BOTH, balance, cubic, drive, oscillator, samples, springs};

/// Contact element with the positions of its sliders.
struct Friction<'a> {
    element: &'a ContactElement,
    positions: Vec<[f64; 2]>,
}

impl Friction<'_> {
    fn of(element: &ContactElement) -> Friction<'_> {
        Friction {
            element,
            positions: vec![[0.0; 2]; element.sliders.len()],
        }
    }

    /// Force and tangent of slider `k`.
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

    /// Force and tangent of sliders and cubic springs at displacement u.
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
        for spring in &self.element.springs {
            let Spring::Cubic {
                direction: d,
                stiffness,
            } = *spring
            else {
                panic!("{spring:?}");
            };
            force[d] += stiffness * u[d].powi(3);
            tangent[d][d] += 3.0 * stiffness * u[d] * u[d];
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

/// Displacements over the last of `periods` cycles of `steps` steps each, and the change from the cycle before.
fn integrate(
    oscillator: &Oscillator,
    load: impl Fn(f64) -> [f64; 3],
    omega: f64,
    (periods, steps): (usize, usize),
) -> (Vec<[f64; 3]>, f64) {
    let mut contact = Friction::of(&oscillator.element);
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
    // The mass is on the diagonal: pivoting is not needed.
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

/// Largest difference between a response and samples over the cycle, relative to the largest displacement, without the means.
fn error(harmonics: &Harmonics, response: &Response, samples: &[[f64; 3]]) -> f64 {
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

/// Oscillator at an angular frequency, and the settings of its time integration.
struct Case {
    name: String,
    oscillator: Oscillator,
    /// Loads of the first harmonic.
    loads: Vec<Load>,
    omega: f64,
    /// Number of periods, and steps per period.
    marched: (usize, usize),
    /// Largest difference between the last period and the one before \[m\].
    transient: f64,
    /// Number of samples of the balance.
    samples: usize,
}

impl Case {
    /// Errors of balances with harmonics up to each of these orders; they must decrease from one to the next.
    fn errors(
        &self,
        highest: &[u32],
        check: impl Fn(u32, &HarmonicBalance<ContactElement>, &Response),
    ) -> Vec<f64> {
        let Case { name, omega, .. } = self;
        let value = |t: f64| {
            let mut force = [0.0; 3];
            for load in &self.loads {
                let (sin, cos) = (omega * t).sin_cos();
                force[load.port] += load.cosine * cos + load.sine * sin;
            }
            force
        };
        let (steady, change) = integrate(&self.oscillator, value, *omega, self.marched);
        assert!(change < self.transient, "{name}: transient {change}");
        let error_with = |&highest: &u32| {
            let balance = balance(
                &self.oscillator,
                highest,
                &self.loads,
                samples(self.samples),
            );
            let response = balance
                .solve(*omega, None)
                .unwrap_or_else(|e| panic!("{e}"));
            let imbalance = response.energy.imbalance();
            assert!(imbalance < 1e-9, "{name}: {imbalance}");
            check(highest, &balance, &response);
            error(balance.harmonics(), &response, &steady)
        };
        let errors: Vec<f64> = highest.iter().map(error_with).collect();
        println!("{name}: {errors:?}");
        assert!(
            errors.windows(2).all(|pair| pair[1] < pair[0]),
            "{name}: {errors:?}"
        );
        errors
    }
}

#[test]
fn jenkins_oscillator() {
    for law in BOTH {
        let case = Case {
            name: format!("Jenkins oscillator, {law:?}"),
            oscillator: oscillator(law),
            loads: drive(260.0),
            omega: 5800.0,
            marched: (220, 4000),
            transient: 1e-13,
            samples: 2048,
        };
        let errors = case.errors(&[1, 3, 5, 9, 15], |_, _, response| {
            assert!(response.energy.friction > 0.3 * response.energy.load_work);
        });
        assert!(
            errors[4] < 2e-5 && errors[0] > 20.0 * errors[4],
            "{errors:?}"
        );
    }
}

/// Orbit in the plane under a load along the normal, on one slider or a bank of six.
fn orbit(law: FrictionLaw, sliders: usize, omega: f64, force: [f64; 3]) -> Case {
    let mut oscillator = oscillator(law);
    oscillator.damping = [700.0, 800.0, 900.0];
    if sliders > 1 {
        oscillator.element = bank(&oscillator.element, sliders);
    }
    let phases = [0.0, -1.3, 0.6];
    Case {
        name: format!("orbit of {force:?} N on {sliders} sliders, {law:?}"),
        oscillator,
        loads: (0..3)
            .map(|axis| Oscillator::load(axis, force[axis], phases[axis]))
            .collect(),
        omega,
        marched: (130, if sliders > 1 { 10_000 } else { 20_000 }),
        transient: 1e-12,
        samples: 256,
    }
}

#[test]
fn orbital_motion_with_varying_normal_load_and_with_separation() {
    // (force along n, whether the element lifts off)
    for (normal, lifts) in [(60.0, false), (330.0, true)] {
        for law in BOTH {
            let case = orbit(law, 1, 5600.0, [230.0, 260.0, normal]);
            let errors = case.errors(&[1, 3, 7, 15], |highest, balance, response| {
                let cycle = &balance.element_cycles(response, balance.sampling())[0];
                assert_eq!(cycle.force.iter().any(|f| f[2] == 0.0), lifts, "{highest}");
            });
            assert!(errors[3] < 1e-4, "{errors:?}");
        }
    }
}

#[test]
fn orbital_motion_on_banks() {
    for law in BOTH {
        let case = orbit(law, 6, 5200.0, [200.0, 160.0, 330.0]);
        let errors = case.errors(&[1, 3, 7, 15], |_, _, _| ());
        assert!(errors[3] < 2e-4, "{errors:?}");
    }
}

#[test]
fn duffing_oscillator() {
    let case = Case {
        name: "Duffing".to_owned(),
        oscillator: Oscillator {
            damping: [600.0; 3],
            element: springs(vec![cubic(0, 1.2e17)]),
            ..oscillator(FrictionLaw::Cone)
        },
        loads: drive(120.0),
        omega: 4700.0,
        marched: (200, 8000),
        transient: 1e-12,
        samples: BalanceSettings::default().samples,
    };
    let errors = case.errors(&[1, 3, 5, 7], |_, _, _| ());
    assert!(
        errors[1] < 0.2 * errors[0] && errors[3] < 1e-5,
        "{errors:?}"
    );
}
