//! What a structure does at its joint under loads that stay: the flexibility along the normal, and what its bodies are free to do.
//!
//! Of all ports G = Σ φφᵀ/ω² + R₀ over the elastic modes φ: the displacement under unit forces, less the rigid motions of free bodies. Bodies
//! that a load may set in motion against each other are held by the pressure p alone: Φ_jᵀ f_p + Φ_lᵀ f = 0 for each rigid mode Φ, with the forces
//! f_p of the pressure at the joint and f of the load.
//!
//! What holds the bodies otherwise may be far softer than the contact, as a beam is that bends. So G is split: G = Q + V C Vᵀ, where V has the
//! motions of the faces as rigid planes that are held and soft, C = (Vᵀ G⁻¹ V)⁻¹, and Q is positive without being soft along them.

use super::StructureError;
use super::reduction::Reduced;
use crate::linalg::Matrix;

/// Part of a rigid mode of unit mass from which on the faces of the joint move against each other in it; and part of the work of a load
/// that nothing bears.
const MOVES: f64 = 1e-6;

/// Of the largest flexibility of a contact element: below it a flexibility is rounding.
const ROUNDING: f64 = 1e-10;

/// A force on a port \[N\].
pub type PortForce = (usize, f64);

/// The statics of a structure along the normal of its joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Statics {
    /// By how much each contact element opens under forces that press its faces apart, G \[m/N\], symmetric, element by element.
    pub flexibility: Matrix,
    /// Motions along which the bodies are free, or the load of the pressure is given, independent of each other: the approach δ \[m\] and the rotations
    /// θ_x, θ_y \[rad\], by which the faces come closer by δ + θ_x y − θ_y x.
    pub motions: Vec<[f64; 3]>,
    /// Motions along which the structure holds its bodies softly; with nothing free, all three.
    pub held: Vec<[f64; 3]>,
    /// C between these, row by row: opening under the resultants of the pressure along them \[m/N\].
    pub held_compliance: Vec<f64>,
    /// Q, the flexibility without that of the held motions \[m/N\].
    pub stiff: Matrix,
    /// What each load does.
    pub loads: Vec<StaticLoad>,
}

/// What a load does at the joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StaticLoad {
    /// By how much it opens each contact element, where no pressure answers it \[m\].
    pub opening: Vec<f64>,
    /// For each free motion the resultant Σ p (δ + θ_x y − θ_y x) dA of the pressure that bears it \[N m\].
    pub resultants: Vec<f64>,
    /// The displacement along it under each of the loads, where no pressure answers them: work \[N m\].
    pub work: Vec<f64>,
}

impl Reduced {
    /// The static flexibility between two ports \[m/N\].
    pub fn flexibility(&self, port: usize, other: usize) -> f64 {
        let modes = self.omega.iter().enumerate();
        let elastic = modes
            .map(|(r, omega)| self.shapes[(port, r)] * self.shapes[(other, r)] / omega.powi(2));
        elastic.sum::<f64>() + self.residual[(port, other)]
    }

    /// The statics under some `loads`, of contact elements with these `centres` \[m\]. If the load is that `of_pressure` whatever holds the bodies, they
    /// are free to come closer, in exchange for the loads on their own faces.
    ///
    /// # Errors
    /// [`StructureError::Unborne`] for a load along a rigid motion that the pressure does not resist, [`StructureError::NotTwoBodies`] for faces
    /// of which parts move against each other.
    pub fn statics(
        &self,
        centres: &[[f64; 2]],
        loads: &[Vec<PortForce>],
        of_pressure: bool,
    ) -> Result<Statics, StructureError> {
        let count = self.ports.contacts;
        let normal = |element: usize| 3 * element + 2;
        let flexibility =
            Matrix::from_fn(count, count, |e, f| self.flexibility(normal(e), normal(f)));
        let mut planes = self.planes(centres, of_pressure)?;
        let found = loads.iter().enumerate().map(|(number, forces)| {
            let opening = (0..count)
                .map(|e| {
                    let terms = forces.iter();
                    terms
                        .map(|&(port, f)| f * self.flexibility(normal(e), port))
                        .sum()
                })
                .collect();
            let along_port = |(port, f): PortForce, others: &[PortForce]| -> f64 {
                let terms = others
                    .iter()
                    .map(|&(other, g)| g * self.flexibility(port, other));
                f * terms.sum::<f64>()
            };
            let work_of = |others: &Vec<PortForce>| {
                let each = forces.iter().map(|&force| along_port(force, others));
                each.sum()
            };
            Ok(StaticLoad {
                work: loads.iter().map(work_of).collect(),
                opening,
                resultants: self.resultants(&planes, centres, number, forces)?,
            })
        });
        let loads = found.collect::<Result<Vec<_>, _>>()?;
        let (held_compliance, stiff) = planes.split(centres, &flexibility)?;
        Ok(Statics {
            motions: planes.motions(&planes.free),
            held: planes.motions(&planes.held),
            held_compliance,
            stiff,
            flexibility,
            loads,
        })
    }

    /// What the pressure must bear of a load along each free motion.
    fn resultants(
        &self,
        planes: &Planes,
        centres: &[[f64; 2]],
        number: usize,
        forces: &[PortForce],
    ) -> Result<Vec<f64>, StructureError> {
        let modes = 0..self.rigid.columns();
        let in_mode = |r: usize| forces.iter().map(move |&(p, f)| self.rigid[(p, r)] * f);
        let mut work: Vec<f64> = modes.clone().map(|r| in_mode(r).sum()).collect();
        let sizes = modes.map(|r| in_mode(r).map(f64::abs).sum::<f64>());
        let size: f64 = sizes.fold(0.0, f64::max);
        let along = planes.free.iter().map(|free| {
            let square: f64 = free.parts.iter().map(|a| a * a).sum();
            if square == 0.0 {
                // No rigid motion: the load on the faces themselves.
                let on_faces = forces.iter().filter(|(port, _)| *port < 3 * centres.len());
                let terms = on_faces.map(|(port, f)| -f * planes.along(free, centres[port / 3]));
                return terms.sum();
            }
            let along: f64 = free.parts.iter().zip(&work).map(|(a, b)| a * b).sum();
            for (work, part) in work.iter_mut().zip(&free.parts) {
                *work -= part * along / square;
            }
            along / square
        });
        let along: Vec<f64> = along.collect();
        let left = work.iter().fold(0.0, |m: f64, w| m.max(w.abs()));
        if left > MOVES * size {
            return Err(StructureError::Unborne {
                load: number,
                share: left / size,
            });
        }
        Ok(planes.resultants(&along))
    }

    /// How the faces move as rigid planes.
    fn planes(&self, centres: &[[f64; 2]], of_pressure: bool) -> Result<Planes, StructureError> {
        let modes = self.rigid.columns();
        let squares = centres.iter().map(|[x, y]| x * x + y * y);
        let lever = (squares.sum::<f64>() / centres.len() as f64).sqrt();
        let field = |at| fields(lever, at);
        // Approach and rotations times the lever of each mode, by least squares over the contact elements.
        let gram = Matrix::from_fn(3, 3, |a, b| {
            centres.iter().map(|&at| field(at)[a] * field(at)[b]).sum()
        });
        let factor = gram.cholesky().map_err(fail)?;
        let mut motion = Matrix::from_fn(3, modes, |a, r| {
            let terms = centres.iter().enumerate();
            terms
                .map(|(e, &at)| -field(at)[a] * self.rigid[(3 * e + 2, r)])
                .sum()
        });
        factor.solve_lower(&mut motion);
        factor.solve_lower_transposed(&mut motion);
        let unit = 1.0 / self.mass.sqrt();
        for r in 0..modes {
            let size = motion.column(r).iter().fold(unit, |m, v| m.max(v.abs()));
            for (e, &at) in centres.iter().enumerate() {
                let closes: f64 = (0..3).map(|a| field(at)[a] * motion[(a, r)]).sum();
                if (closes + self.rigid[(3 * e + 2, r)]).abs() > MOVES * size {
                    return Err(StructureError::NotTwoBodies { element: e });
                }
            }
        }
        let squares = motion.times_transpose(&motion);
        let (values, vectors) = squares.symmetric_eigen().map_err(fail)?;
        let mut planes = Planes {
            lever,
            free: Vec::new(),
            held: Vec::new(),
        };
        for (k, value) in values.iter().enumerate() {
            let of = [0, 1, 2].map(|a| vectors[(a, k)]);
            let parts = (0..modes).map(|r| (0..3).map(|a| of[a] * motion[(a, r)]).sum());
            match *value > (MOVES * unit).powi(2) {
                true => planes.free.push(Plane {
                    direction: clean(of),
                    parts: parts.collect(),
                }),
                false => planes.held.push(Plane {
                    direction: clean(of),
                    parts: Vec::new(),
                }),
            }
        }
        if of_pressure {
            planes.free_approach();
        }
        Ok(planes)
    }
}

fn fail(source: crate::linalg::LinalgError) -> StructureError {
    StructureError::Factorization {
        matrix: "the motions of the faces of the joint",
        source,
    }
}

/// Approach and rotations times a lever at a place: by how much each brings the faces closer there.
fn fields(lever: f64, [x, y]: [f64; 2]) -> [f64; 3] {
    [1.0, y / lever, -x / lever]
}

/// A unit vector without what it has of others by rounding.
fn clean(direction: [f64; 3]) -> [f64; 3] {
    match direction.map(|v| if v.abs() > MOVES { v } else { 0.0 }) {
        [_, 0.0, 0.0] => [1.0, 0.0, 0.0],
        other => other,
    }
}

/// A motion of the faces as rigid planes.
struct Plane {
    /// Approach, and rotations times the lever; the directions of all are orthonormal.
    direction: [f64; 3],
    /// By how much every rigid mode moves the bodies along it; of different planes orthogonal. All zero, or none, of one that no mode has.
    parts: Vec<f64>,
}

/// All three of them.
struct Planes {
    /// Length by which rotations are counted as displacements \[m\].
    lever: f64,
    free: Vec<Plane>,
    held: Vec<Plane>,
}

impl Planes {
    /// By how much a motion brings the faces closer at a place.
    fn along(&self, plane: &Plane, at: [f64; 2]) -> f64 {
        let fields = fields(self.lever, at);
        (0..3).map(|a| plane.direction[a] * fields[a]).sum()
    }

    /// Frees the part of the approach that is held.
    fn free_approach(&mut self) {
        let mut direction = [0.0; 3];
        for plane in &self.held {
            (0..3).for_each(|a| direction[a] += plane.direction[0] * plane.direction[a]);
        }
        let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
        if length <= MOVES {
            return;
        }
        let freed = clean(direction.map(|d| d / length));
        // What is left of the held ones without it, orthonormal again.
        let mut left: Vec<[f64; 3]> = Vec::new();
        for plane in self.held.drain(..) {
            let mut of = plane.direction;
            for other in left.iter().chain([&freed]) {
                let along: f64 = (0..3).map(|a| of[a] * other[a]).sum();
                (0..3).for_each(|a| of[a] -= along * other[a]);
            }
            let length = of.iter().map(|d| d * d).sum::<f64>().sqrt();
            if length > MOVES.sqrt() {
                left.push(of.map(|d| d / length));
            }
        }
        let plane = |direction| Plane {
            direction,
            parts: Vec::new(),
        };
        self.held = left.into_iter().map(plane).collect();
        self.free.push(plane(freed));
    }

    /// Approach and rotations of some of them; one after the other where these are all.
    fn motions(&self, of: &[Plane]) -> Vec<[f64; 3]> {
        match of.len() {
            3 => vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            _ => {
                let turned = |[a, x, y]: [f64; 3]| [a, x / self.lever, y / self.lever];
                of.iter().map(|plane| turned(plane.direction)).collect()
            }
        }
    }

    /// Resultants along the free motions, from those along their directions.
    fn resultants(&self, along: &[f64]) -> Vec<f64> {
        if along.len() < 3 {
            return along.to_vec();
        }
        let turned = [1.0, self.lever, self.lever].into_iter().enumerate();
        turned
            .map(|(a, lever)| {
                let terms = self.free.iter().zip(along);
                lever * terms.map(|(plane, r)| plane.direction[a] * r).sum::<f64>()
            })
            .collect()
    }

    /// By how much the held motion `k` brings the faces closer at a place; where all three are held, those of [`Planes::motions`].
    fn along_held(&self, k: usize, at: [f64; 2]) -> f64 {
        match self.held.len() {
            3 => [1.0, at[1], -at[0]][k],
            _ => self.along(&self.held[k], at),
        }
    }

    /// The compliance of the held motions, and the flexibility without it. Where bodies are free to come closer, only motions that are softer than a
    /// contact element stay among those held: the flexibility keeps the other ones, with which the contact is solved at once.
    fn split(
        &mut self,
        centres: &[[f64; 2]],
        flexibility: &Matrix,
    ) -> Result<(Vec<f64>, Matrix), StructureError> {
        let (count, held) = (centres.len(), self.held.len());
        if held == 0 {
            return Ok((Vec::new(), flexibility.clone()));
        }
        let largest = (0..count).fold(0.0, |m: f64, e| m.max(flexibility[(e, e)]));
        let whole = Matrix::from_fn(count, count, |e, f| {
            flexibility[(e, f)] + if e == f { ROUNDING * largest } else { 0.0 }
        });
        let factor = whole.cholesky().map_err(fail)?;
        let at = |k: usize, e: usize| match k.checked_sub(held) {
            None => self.along_held(k, centres[e]),
            Some(k) => self.along(&self.free[k], centres[e]),
        };
        let all = held + self.free.len();
        let mut solved = Matrix::from_fn(count, all, |e, k| at(k, e));
        factor.solve_lower(&mut solved);
        let stiffness = solved.transpose_times(&solved);
        // C of the first of all motions.
        let compliance_of = |first: usize| -> Result<Matrix, StructureError> {
            let own = Matrix::from_fn(first, first, |a, b| stiffness[(a, b)]);
            let factor = own.cholesky().map_err(fail)?;
            let mut inverse = Matrix::from_fn(first, first, |a, b| f64::from(a == b));
            factor.solve_lower(&mut inverse);
            factor.solve_lower_transposed(&mut inverse);
            Ok(inverse)
        };
        let soft = |at: &dyn Fn(usize, usize) -> f64, of: &Matrix, e: usize, f: usize| -> f64 {
            let count = of.columns();
            let pairs = (0..count).flat_map(|k| (0..count).map(move |m| (k, m)));
            pairs.map(|(k, m)| at(k, e) * of[(k, m)] * at(m, f)).sum()
        };
        let mut compliance = compliance_of(held)?;
        if !self.free.is_empty() {
            let of_all = compliance_of(all)?;
            let own = (0..count).map(|e| flexibility[(e, e)] - soft(&at, &of_all, e, e));
            let of_element = own.sum::<f64>() / count as f64;
            let (values, vectors) = compliance.symmetric_eigen().map_err(fail)?;
            let kept: Vec<usize> = (0..held).filter(|k| values[*k] > of_element).collect();
            let plane = |k: &usize| {
                let along = |a: usize| -> f64 {
                    let each = self.held.iter().enumerate();
                    each.map(|(m, plane)| vectors[(m, *k)] * plane.direction[a])
                        .sum()
                };
                Plane {
                    direction: [0, 1, 2].map(along),
                    parts: Vec::new(),
                }
            };
            self.held = kept.iter().map(plane).collect();
            compliance = Matrix::from_fn(kept.len(), kept.len(), |a, b| {
                if a == b { values[kept[a]] } else { 0.0 }
            });
        }
        let held = self.held.len();
        let at = |k: usize, e: usize| self.along_held(k, centres[e]);
        let stiff = Matrix::from_fn(count, count, |e, f| {
            flexibility[(e, f)] - soft(&at, &compliance, e, f)
        });
        let compliance = (0..held * held).map(|k| compliance[(k / held, k % held)]);
        Ok((compliance.collect(), stiff))
    }
}
