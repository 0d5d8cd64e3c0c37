//! Static response of a structure at its joint: the flexibility along the normal, and the free motions of its bodies.
//!
//! The flexibility of all ports is G = Σ φφᵀ/ω² + R₀, with the sum over the elastic modes φ. G is the displacement
//! under unit forces without the rigid motions of free bodies. If a load can move two bodies rigidly against each
//! other, only the pressure at the joint balances the load. The balance for each rigid mode Φ is Φ_jᵀ f_p + Φ_lᵀ f = 0.
//! The pressure exerts the forces f_p at the joint, and the load exerts the forces f.
//!
//! Other supports of the bodies may be much softer than the contact, for example a beam in bending. To separate soft
//! supports from the contact, the flexibility G is split: G = Q + V C Vᵀ. The columns of V are motions of the faces as
//! rigid planes that the structure supports softly. The compliance of the motions V is C = (Vᵀ G⁻¹ V)⁻¹. The
//! flexibility Q is positive and stiff along V.

use super::StructureError;
use super::reduction::ReducedStructure;
use crate::linalg::Matrix;

/// In a rigid mode, the faces of the joint move against each other if their relative displacement exceeds a limit. The
/// limit is `MOTION_TOLERANCE` times a motion of unit mass. A load is unbalanced if a motion without resistance takes
/// more than `MOTION_TOLERANCE` of the work of the load.
const MOTION_TOLERANCE: f64 = 1e-6;

/// A flexibility is a rounding error if it is below `ROUNDING` times the largest flexibility of a contact element.
const ROUNDING: f64 = 1e-10;

/// Force on a port \[N\], as the number of the port and the force.
pub type PortForce = (usize, f64);

/// Static response of a structure along the normal of its joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Statics {
    /// Opening of each contact element under unit forces that push the faces apart: G \[m/N\], symmetric, element by
    /// element.
    pub flexibility: Matrix,
    /// Linearly independent free motions of the bodies. A motion has the approach δ \[m\] and the rotations θ_x, θ_y
    /// \[rad\]. The faces approach each other by δ + θ_x y − θ_y x. If the scene prescribes the pressure, the motion
    /// along the pressure is free.
    pub free_motions: Vec<[f64; 3]>,
    /// Motions that the structure supports softly. If no motion is free, the list has all three motions.
    pub supported_motions: Vec<[f64; 3]>,
    /// Compliance matrix C of the softly supported motions, row by row \[m/N\]. The opening along the motions is C
    /// times the resultants of the pressure along the motions.
    pub supported_compliance: Vec<f64>,
    /// Flexibility Q without the share of the softly supported motions \[m/N\].
    pub remaining_flexibility: Matrix,
    /// Response to each load.
    pub loads: Vec<StaticLoad>,
}

/// Response of the joint to one load.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StaticLoad {
    /// Opening of each contact element under the load without pressure \[m\].
    pub opening: Vec<f64>,
    /// Resultants Σ p (δ + θ_x y − θ_y x) dA of the pressure that balances the load \[N m\]. The list has one resultant
    /// per free motion.
    pub resultants: Vec<f64>,
    /// Work of the load in the displacements under each load of the response, without pressure \[N m\].
    pub work: Vec<f64>,
}

impl ReducedStructure {
    /// Returns the static flexibility between two ports \[m/N\].
    pub fn flexibility(&self, port: usize, other: usize) -> f64 {
        let modes = self.omega.iter().enumerate();
        let elastic = modes
            .map(|(r, omega)| self.shapes[(port, r)] * self.shapes[(other, r)] / omega.powi(2));
        elastic.sum::<f64>() + self.residual[(port, other)]
    }

    /// Computes the static response of the contact elements at `centres` \[m\] to `loads`.
    ///
    /// `of_pressure` is true if the scene defines the preload by a pressure, for any supports of the bodies. Under a
    /// prescribed pressure, the bodies are free to approach each other. Along the approach, only the loads on the faces
    /// of the bodies count.
    ///
    /// # Errors
    /// [`StructureError::UnbalancedLoad`] if a load acts along a rigid motion that the pressure does not resist.
    /// [`StructureError::NotTwoBodies`] if a face does not move as one rigid body.
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
        let responses = loads.iter().enumerate().map(|(number, forces)| {
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
                let work_terms = forces.iter().map(|&force| along_port(force, others));
                work_terms.sum()
            };
            Ok(StaticLoad {
                work: loads.iter().map(work_of).collect(),
                opening,
                resultants: self.resultants(&planes, centres, number, forces)?,
            })
        });
        let loads = responses.collect::<Result<Vec<_>, _>>()?;
        let (held_compliance, stiff) = planes.split(centres, &flexibility)?;
        Ok(Statics {
            free_motions: planes.motions(&planes.free),
            supported_motions: planes.motions(&planes.held),
            supported_compliance: held_compliance,
            remaining_flexibility: stiff,
            flexibility,
            loads,
        })
    }

    /// Returns the resultants of the pressure that balance a load, one for each free motion.
    fn resultants(
        &self,
        planes: &PlaneMotions,
        centres: &[[f64; 2]],
        number: usize,
        forces: &[PortForce],
    ) -> Result<Vec<f64>, StructureError> {
        let modes = 0..self.rigid.columns();
        let in_mode = |r: usize| forces.iter().map(move |&(p, f)| self.rigid[(p, r)] * f);
        let mut work: Vec<f64> = modes.clone().map(|r| in_mode(r).sum()).collect();
        let sizes = modes.map(|r| in_mode(r).map(f64::abs).sum::<f64>());
        // A motion of unit mass is the scale of rounding where no rigid mode moves the loaded ports.
        let unit = forces.iter().map(|(_, f)| f.abs()).sum::<f64>() / self.mass.sqrt();
        let size: f64 = sizes.fold(unit, f64::max);
        let along = planes.free.iter().map(|free| {
            let square: f64 = free.parts.iter().map(|a| a * a).sum();
            if square == 0.0 {
                // No rigid mode moves the faces along the free motion. The load along the free motion is then the sum
                // of the forces on the faces.
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
        let unbalanced = work.iter().fold(0.0, |m: f64, w| m.max(w.abs()));
        if unbalanced > MOTION_TOLERANCE * size {
            return Err(StructureError::UnbalancedLoad {
                load: number,
                share: unbalanced / size,
            });
        }
        Ok(planes.resultants(&along))
    }

    /// Finds the motions of the faces as rigid planes that are free or held.
    fn planes(
        &self,
        centres: &[[f64; 2]],
        of_pressure: bool,
    ) -> Result<PlaneMotions, StructureError> {
        let modes = self.rigid.columns();
        let squares = centres.iter().map(|[x, y]| x * x + y * y);
        let lever = (squares.sum::<f64>() / centres.len() as f64).sqrt();
        let field = |at| fields(lever, at);
        // Approach, and rotations times the lever, of each rigid mode: a least-squares fit over the contact elements.
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
                let approach: f64 = (0..3).map(|a| field(at)[a] * motion[(a, r)]).sum();
                if (approach + self.rigid[(3 * e + 2, r)]).abs() > MOTION_TOLERANCE * size {
                    return Err(StructureError::NotTwoBodies { element: e });
                }
            }
        }
        let squares = motion.times_transpose(&motion);
        let (values, vectors) = squares.symmetric_eigen().map_err(fail)?;
        let mut planes = PlaneMotions {
            lever,
            free: Vec::new(),
            held: Vec::new(),
        };
        for (k, value) in values.iter().enumerate() {
            let direction = [0, 1, 2].map(|a| vectors[(a, k)]);
            let parts = (0..modes).map(|r| (0..3).map(|a| direction[a] * motion[(a, r)]).sum());
            match *value > (MOTION_TOLERANCE * unit).powi(2) {
                true => planes.free.push(PlaneMotion {
                    direction: clean(direction),
                    parts: parts.collect(),
                }),
                false => planes.held.push(PlaneMotion {
                    direction: clean(direction),
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

/// Returns by how much the approach and each rotation times the lever close the gap at a place.
fn fields(lever: f64, [x, y]: [f64; 2]) -> [f64; 3] {
    [1.0, y / lever, -x / lever]
}

/// Removes the rounding errors from a unit vector along the approach or in the plane of the rotations.
fn clean(direction: [f64; 3]) -> [f64; 3] {
    match direction.map(|v| if v.abs() > MOTION_TOLERANCE { v } else { 0.0 }) {
        [_, 0.0, 0.0] => [1.0, 0.0, 0.0],
        other => other,
    }
}

/// Motion of the faces as rigid planes.
struct PlaneMotion {
    /// Approach, and rotations times the lever. The directions of all motions are orthonormal.
    direction: [f64; 3],
    /// Displacement of the faces along the plane motion in each rigid mode. The vectors of different motions are
    /// orthogonal. Empty or zero if no rigid mode has the motion.
    parts: Vec<f64>,
}

/// All three motions of the faces as rigid planes.
struct PlaneMotions {
    /// Length that converts rotations to displacements \[m\].
    lever: f64,
    free: Vec<PlaneMotion>,
    held: Vec<PlaneMotion>,
}

impl PlaneMotions {
    /// Returns by how much a motion closes the gap at a place.
    fn along(&self, plane: &PlaneMotion, at: [f64; 2]) -> f64 {
        let fields = fields(self.lever, at);
        (0..3).map(|a| plane.direction[a] * fields[a]).sum()
    }

    /// Makes the held part of the approach a free motion.
    fn free_approach(&mut self) {
        let mut direction = [0.0; 3];
        for plane in &self.held {
            (0..3).for_each(|a| direction[a] += plane.direction[0] * plane.direction[a]);
        }
        let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
        if length <= MOTION_TOLERANCE {
            return;
        }
        let freed = clean(direction.map(|d| d / length));
        // Remove the freed direction from the held motions, and make them orthonormal again.
        let mut remaining: Vec<[f64; 3]> = Vec::new();
        for plane in self.held.drain(..) {
            let mut rest = plane.direction;
            for other in remaining.iter().chain([&freed]) {
                let along: f64 = (0..3).map(|a| rest[a] * other[a]).sum();
                (0..3).for_each(|a| rest[a] -= along * other[a]);
            }
            let length = rest.iter().map(|d| d * d).sum::<f64>().sqrt();
            if length > MOTION_TOLERANCE.sqrt() {
                remaining.push(rest.map(|d| d / length));
            }
        }
        let plane = |direction| PlaneMotion {
            direction,
            parts: Vec::new(),
        };
        self.held = remaining.into_iter().map(plane).collect();
        self.free.push(plane(freed));
    }

    /// Returns the approach and rotations of some motions. If there are three, returns the approach and the
    /// rotations.
    fn motions(&self, planes: &[PlaneMotion]) -> Vec<[f64; 3]> {
        match planes.len() {
            3 => vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            _ => {
                let scaled = |[a, x, y]: [f64; 3]| [a, x / self.lever, y / self.lever];
                planes.iter().map(|plane| scaled(plane.direction)).collect()
            }
        }
    }

    /// Converts resultants along the directions of the free motions to resultants along [`PlaneMotions::motions`].
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

    /// Returns by how much held motion `k` closes the gap at a place. If all three motions are held, the held motions
    /// are the motions of [`PlaneMotions::motions`].
    fn along_held(&self, k: usize, at: [f64; 2]) -> f64 {
        match self.held.len() {
            3 => [1.0, at[1], -at[0]][k],
            _ => self.along(&self.held[k], at),
        }
    }

    /// Splits the flexibility into the compliance of the held motions and the rest.
    ///
    /// If some motion is free, only the motions that are softer than a contact element remain held. The flexibility
    /// keeps the others, and the contact solver handles them directly.
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
        // Compliance C of the `first` motions.
        let compliance_of = |first: usize| -> Result<Matrix, StructureError> {
            let motion_stiffness = Matrix::from_fn(first, first, |a, b| stiffness[(a, b)]);
            let factor = motion_stiffness.cholesky().map_err(fail)?;
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
            let compliance_of_all = compliance_of(all)?;
            let element_flexibilities =
                (0..count).map(|e| flexibility[(e, e)] - soft(&at, &compliance_of_all, e, e));
            let element_flexibility = element_flexibilities.sum::<f64>() / count as f64;
            let (values, vectors) = compliance.symmetric_eigen().map_err(fail)?;
            let soft_motions: Vec<usize> = (0..held)
                .filter(|k| values[*k] > element_flexibility)
                .collect();
            let plane = |k: &usize| {
                let along = |a: usize| -> f64 {
                    let held_motions = self.held.iter().enumerate();
                    held_motions
                        .map(|(m, plane)| vectors[(m, *k)] * plane.direction[a])
                        .sum()
                };
                PlaneMotion {
                    direction: [0, 1, 2].map(along),
                    parts: Vec::new(),
                }
            };
            self.held = soft_motions.iter().map(plane).collect();
            compliance = Matrix::from_fn(soft_motions.len(), soft_motions.len(), |a, b| {
                if a == b { values[soft_motions[a]] } else { 0.0 }
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
