//! The small model: modes, and the static residual of everything above them, at the ports.
//!
//! A *port* is a combination of displacements where a force may act: the relative displacements of the contact elements (upper
//! minus lower body, of a pair of nodes or the mean over the four pairs of a face), then the drive and response points. With unit forces on
//! the ports the receptance is
//!
//! H(ω) = Σ_rigid φφᵀ/(−ω²) + Σ_r φφᵀ/(ω_r² − ω² + 2iζω_rω) + R₀ + ω²R₁,
//!
//! where R₀ + ω²R₁ stands for the modes above the n kept ones, Σ_{r>n} φφᵀ/(ω_r² − ω²) = R₀ + ω²R₁ + O(ω⁴/ω_n⁴): the residual
//! flexibility of MacNeal (Comput. Struct. 1, 1971) and the residual mass of Rubin (AIAA J. 13, 1975). The residual is the
//! flexibility of K + s·M less the modes' share, for two shifts s, so the rigid modes need no support. Ports are eliminated last:
//! their flexibility is a small dense factor, not a thousand solves.
//!
//! Force on a port acts along its displacement: a positive force on a contact port pulls the upper body along the positive axis
//! and the lower one against it; along z it opens the joint.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::linalg::{LinalgError, Matrix, SparseCholesky};
use crate::structure::StructureError;
use crate::structure::assembly::{Combination, System};
use crate::structure::mesh::Point;
use crate::structure::modes::{ModeOptions, lowest, rigid_modes, shift};
use crate::structure::resonator::FacingFaces;

/// The second shift, at which the residual's slope is taken, as a share of the highest kept eigenvalue: small enough that the
/// next term of the series is below a percent of the slope's, large enough that the difference keeps its digits.
const SLOPE_SHARE: f64 = 0.01;

/// Where the reduced structure is held against the whole one, as a part of the highest kept frequency: harmonics that matter lie below.
const CHECKED: f64 = 0.5;

/// Part of a rigid mode of unit mass from which on a spring holds it.
const HELD: f64 = 1e-6;

/// What a contact element of a structure is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactPorts {
    /// A face between four pairs of nodes: the mean of their relative displacements, and a quarter of the force on each.
    #[default]
    Faces,
    /// A pair of nodes, with a quarter of each face around it.
    Nodes,
}

impl ContactPorts {
    /// True of faces. A recipe says what else they are.
    pub fn are_faces(&self) -> bool {
        *self == ContactPorts::Faces
    }
}

/// The ports of a structure: three for each contact element, then three for each point; x, y, z in turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Ports {
    /// Degrees of freedom and weights of each port.
    pub combinations: Vec<Combination>,
    /// Number of contact elements; contact element e has the ports 3e, 3e + 1, 3e + 2.
    pub contacts: usize,
    /// Names of the points, in order.
    pub points: Vec<String>,
}

impl Ports {
    /// Ports of contact elements and points.
    pub fn new(contacts: &[FacingFaces], points: &[Point], at: ContactPorts) -> Ports {
        let elements: Vec<Vec<(usize, usize)>> = match at {
            ContactPorts::Faces => contacts.iter().map(|face| face.pairs.to_vec()).collect(),
            ContactPorts::Nodes => {
                let pairs = contacts
                    .iter()
                    .flat_map(|face| face.corners().into_iter().zip(face.pairs));
                let by_place: BTreeMap<[usize; 2], (usize, usize)> = pairs.collect();
                by_place.into_values().map(|pair| vec![pair]).collect()
            }
        };
        let mut combinations = Vec::with_capacity(3 * (elements.len() + points.len()));
        for pairs in &elements {
            let share = 1.0 / pairs.len() as f64;
            for axis in 0..3 {
                let both = pairs.iter().flat_map(|&(lower, upper)| {
                    [(3 * lower + axis, -share), (3 * upper + axis, share)]
                });
                combinations.push(both.collect());
            }
        }
        for point in points {
            for axis in 0..3 {
                let all = point.weights.iter();
                combinations.push(all.map(|&(n, w)| (3 * n + axis, w)).collect());
            }
        }
        Ports {
            combinations,
            contacts: elements.len(),
            points: points.iter().map(|p| p.name.clone()).collect(),
        }
    }

    /// Number of ports.
    pub fn len(&self) -> usize {
        self.combinations.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.combinations.is_empty()
    }

    /// Number of contact ports; they come first.
    pub fn contact_ports(&self) -> usize {
        3 * self.contacts
    }

    /// The port of a point along an axis (0, 1, 2 for x, y, z).
    pub fn of_point(&self, name: &str, axis: usize) -> Option<usize> {
        let place = self.points.iter().position(|p| p == name)?;
        Some(self.contact_ports() + 3 * place + axis)
    }

    /// The nodes of a structure that ports take part in, ascending.
    fn checked_nodes(&self, system: &System) -> Result<Vec<usize>, StructureError> {
        let dofs = self.combinations.iter().flatten();
        let mut nodes: Vec<usize> = dofs.map(|&(dof, _)| dof / 3).collect();
        nodes.sort_unstable();
        nodes.dedup();
        match nodes.last() {
            Some(&index) if index >= system.coordinates.len() => Err(StructureError::NoSuch {
                what: "node",
                index,
                count: system.coordinates.len(),
            }),
            _ => Ok(nodes),
        }
    }

    /// Displacements of the ports, one row each, from those of all degrees of freedom.
    pub(super) fn displacements(&self, shapes: &Matrix) -> Matrix {
        Matrix::from_fn(self.len(), shapes.columns(), |port, c| {
            let column = shapes.column(c);
            let terms = self.combinations[port].iter();
            terms.map(|&(dof, weight)| weight * column[dof]).sum()
        })
    }
}

/// A structure reduced to its ports.
#[derive(Debug, Clone, PartialEq)]
pub struct Reduced {
    /// The ports: what the rows below are.
    pub ports: Ports,
    /// Rigid modes at the ports \[kg^-1/2\], one column each; contact ports of bodies that hang together have zeros.
    pub rigid: Matrix,
    /// Angular frequencies of the elastic modes \[rad/s\], ascending.
    pub omega: Vec<f64>,
    /// Elastic modes at the ports \[kg^-1/2\], one column each.
    pub shapes: Matrix,
    /// Static residual R₀ \[m/N\], symmetric, port by port.
    pub residual: Matrix,
    /// Its slope R₁ over ω² \[m s²/N\], symmetric, port by port.
    pub residual_slope: Matrix,
    /// Viscous damping between the modes, rigid ones first \[1/s\]; none where the structure has none of its own.
    pub damping: Option<Matrix>,
    /// Hysteretic damping between the modes, rigid ones first \[1/s²\]; none where the structure has none.
    pub hysteretic: Option<Matrix>,
    /// Mass of the structure \[kg\].
    pub mass: f64,
    /// Largest relative residual of the modes.
    pub mode_residual: f64,
    /// Entries of the sparse factor: eight bytes each.
    pub factor_entries: usize,
    /// The structure's own flexibility elsewhere; none of a reduced structure that is read back.
    pub checked: Option<Checked>,
}

/// The flexibility of a structure at a shift that its reduction is not made from: what the reduction leaves out can be told by it.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    /// The shift s \[rad²/s²\].
    pub shift: f64,
    /// Bᵀ(K + sM)⁻¹B \[m/N\], symmetric, port by port.
    pub flexibility: Matrix,
}

impl Checked {
    /// The imaginary frequency that the shift is \[Hz\].
    pub fn frequency(&self) -> f64 {
        self.shift.sqrt() / std::f64::consts::TAU
    }
}

/// Reduces a structure to its ports.
///
/// # Errors
/// A port that refers to a node that does not exist, modes that do not converge, a stiffness that is not one.
pub fn reduce(
    system: &System,
    ports: Ports,
    options: &ModeOptions,
) -> Result<Reduced, StructureError> {
    reduce_with_shapes(system, ports, &[], options).map(|(reduced, _)| reduced)
}

/// Reduces a structure to its ports, and gives its modes \[kg^-1/2\] at `nodes` too: three rows each (x, y, z), rigid modes first, one
/// column each.
///
/// # Errors
/// Those of [`reduce`].
///
/// # Panics
/// On a node that does not exist.
pub fn reduce_with_shapes(
    system: &System,
    ports: Ports,
    nodes: &[usize],
    options: &ModeOptions,
) -> Result<(Reduced, Matrix), StructureError> {
    let shown = nodes;
    let nodes = ports.checked_nodes(system)?;
    let order = system.elimination_order(&nodes);
    let fail = |source: LinalgError| StructureError::Factorization {
        matrix: "the energy of the rigid motions",
        source,
    };
    let small = shift(system);
    let factor = system.shifted_factor(small, &order)?;
    let rigid_shapes = rigid_modes(system, small).map_err(fail)?;
    let modes = lowest(system, &factor, small, &rigid_shapes, options)?;
    let rigid = ports.displacements(&rigid_shapes);
    let shapes = ports.displacements(&modes.shapes);
    let held = rigid_shapes.columns();
    let at_nodes = Matrix::from_fn(3 * shown.len(), held + shapes.columns(), |row, mode| {
        let dof = 3 * shown[row / 3] + row % 3;
        match mode.checked_sub(held) {
            None => rigid_shapes[(dof, mode)],
            Some(elastic) => modes.shapes[(dof, elastic)],
        }
    });
    let found = ModesAtPorts {
        rigid_squares: vec![0.0; rigid.columns()],
        rigid,
        omega: modes.omega,
        shapes,
        residual: modes.residuals.iter().copied().fold(0.0, f64::max),
    };
    let count = 3 * nodes.len();
    let reduced = complete(
        ports,
        found,
        system.total_mass(),
        (factor, small, count),
        |shift| system.shifted_factor(shift, &order),
    )?;
    Ok((reduced, at_nodes))
}

/// The kept modes of a structure at its ports.
pub(super) struct ModesAtPorts {
    /// Rigid modes \[kg^-1/2\], one column each.
    pub rigid: Matrix,
    /// What the digits of the stiffness leave of their ω² \[rad²/s²\]: it is not to become a part of the residual.
    pub rigid_squares: Vec<f64>,
    /// Angular frequencies of the elastic ones \[rad/s\], ascending.
    pub omega: Vec<f64>,
    /// Elastic modes \[kg^-1/2\], one column each.
    pub shapes: Matrix,
    /// Largest relative residual of them.
    pub residual: f64,
}

/// The reduced structure: its kept modes, and what all others leave at the ports. The first factor is that of K + shift·M, whose last
/// `count` rows are those of the ports; `refactor` makes the one of another shift.
pub(super) fn complete(
    ports: Ports,
    modes: ModesAtPorts,
    mass: f64,
    (factor, small, count): (SparseCholesky, f64, usize),
    refactor: impl Fn(f64) -> Result<SparseCholesky, StructureError>,
) -> Result<Reduced, StructureError> {
    let ModesAtPorts {
        rigid,
        rigid_squares,
        omega,
        shapes,
        residual: mode_residual,
    } = modes;
    let above = |factor: &SparseCholesky, shift: f64| {
        let mut flexibility = port_flexibility(factor, &ports, count);
        remove(&mut flexibility, &rigid, |r| {
            1.0 / (rigid_squares[r] + shift)
        });
        remove(&mut flexibility, &shapes, |r| {
            1.0 / (omega[r].powi(2) + shift)
        });
        flexibility
    };
    let factor_entries = factor.entries();
    let highest = omega[omega.len() - 1];
    let step = SLOPE_SHARE * highest * highest;
    // Two factors at a time would be the peak of memory.
    let (near, small) = if small <= step {
        let near = above(&factor, small);
        drop(factor);
        (near, small)
    } else {
        // A shift that suits the modes may be far from where a series about zero is right.
        drop(factor);
        (above(&refactor(step)?, step), step)
    };
    let large = small + step;
    let far = above(&refactor(large)?, large);
    // R(−s) = R₀ − s R₁ at both shifts.
    let mut residual_slope = Matrix::zeros(ports.len(), ports.len());
    residual_slope.add(1.0 / (large - small), &near);
    residual_slope.add(-1.0 / (large - small), &far);
    let mut residual = near;
    residual.add(small, &residual_slope);
    let shift = (CHECKED * highest).powi(2);
    let checked = Checked {
        shift,
        flexibility: port_flexibility(&refactor(shift)?, &ports, count),
    };
    Ok(Reduced {
        rigid,
        omega,
        shapes,
        residual,
        residual_slope,
        damping: None,
        hysteretic: None,
        mass,
        mode_residual,
        factor_entries,
        checked: Some(checked),
        ports,
    })
}

/// Displacement of the ports under unit forces on them, statically: Bᵀ K⁻¹ B \[m/N\], symmetric, port by port. The structure must be
/// held: springs to the ground are as good as a support.
///
/// # Errors
/// A structure that may move as a whole, or a port that refers to a node that does not exist.
pub fn flexibility(system: &System, ports: &Ports) -> Result<Matrix, StructureError> {
    let nodes = ports.checked_nodes(system)?;
    let factor = system.shifted_factor(0.0, &system.elimination_order(&nodes))?;
    Ok(port_flexibility(&factor, ports, 3 * nodes.len()))
}

/// Bᵀ A⁻¹ B for the ports' columns B, from the last `count` rows of the factor of A.
fn port_flexibility(factor: &SparseCholesky, ports: &Ports, count: usize) -> Matrix {
    let mut place = std::collections::HashMap::new();
    for (p, &dof) in factor.last_rows(count).iter().enumerate() {
        place.insert(dof, p);
    }
    let mut columns = Matrix::zeros(count, ports.len());
    for (port, combination) in ports.combinations.iter().enumerate() {
        for (dof, weight) in combination {
            columns[(place[dof], port)] += weight;
        }
    }
    factor.trailing_factor(count).solve_lower(&mut columns);
    columns.transpose_times(&columns)
}

/// Takes Σ weight·φφᵀ over the columns of `shapes` away from a flexibility.
pub fn remove(flexibility: &mut Matrix, shapes: &Matrix, weight: impl Fn(usize) -> f64) {
    let weighted = Matrix::from_fn(shapes.columns(), shapes.rows(), |r, port| {
        weight(r) * shapes[(port, r)]
    });
    flexibility.add_product(-1.0, shapes, &weighted);
}

impl Reduced {
    /// The residual R₀ + ω²R₁ \[m/N\] at an angular frequency. Over a narrow band it is as good as constant.
    pub fn residual_at(&self, omega: f64) -> Matrix {
        let mut residual = self.residual.clone();
        residual.add(omega * omega, &self.residual_slope);
        residual
    }

    /// Receptance \[m/N\] of all ports at angular frequency `omega` > 0 with a modal damping ratio ζ, its real and imaginary
    /// part, with e^{+iωt}: a lag is a negative imaginary part. Rigid modes and the residual are undamped.
    pub fn receptance(&self, omega: f64, damping_ratio: f64) -> (Matrix, Matrix) {
        let squared = omega * omega;
        let mut real = self.residual_at(omega);
        let mut imaginary = Matrix::zeros(self.ports.len(), self.ports.len());
        remove(&mut real, &self.rigid, |_| 1.0 / squared);
        let denominator = |r: usize| {
            let stiff = self.omega[r].powi(2) - squared;
            let damped = 2.0 * damping_ratio * self.omega[r] * omega;
            let size = stiff * stiff + damped * damped;
            (stiff / size, damped / size)
        };
        remove(&mut real, &self.shapes, |r| -denominator(r).0);
        if damping_ratio != 0.0 {
            remove(&mut imaginary, &self.shapes, |r| denominator(r).1);
        }
        (real, imaginary)
    }

    /// Modes of the structure with springs on its contact ports (one stiffness \[N/m\] each, as the contact ports are
    /// ordered): the joint stuck. The modal stiffness is Ω² + Φᵀ(k⁻¹ + R)⁻¹Φ over rigid and elastic modes, with the residual R
    /// taken at angular frequency `omega`: modes near it are the most accurate. Springs of zero stiffness are left out; k = ∞
    /// bonds.
    ///
    /// # Errors
    /// As many stiffnesses as contact ports, none negative.
    pub fn with_springs(
        &self,
        stiffness: &[f64],
        omega: f64,
    ) -> Result<SprungModes, StructureError> {
        let contact = self.ports.contact_ports();
        if stiffness.len() != contact {
            return Err(StructureError::DoNotFit {
                name: "the number of spring stiffnesses",
                value: stiffness.len() as f64,
                other: "the number of contact ports",
                other_value: contact as f64,
                expected: "they must be equal",
            });
        }
        if let Some(&value) = stiffness.iter().find(|k| k.is_nan() || **k < 0.0) {
            return Err(StructureError::OutOfRange {
                name: "a spring stiffness",
                value,
                expected: "zero or positive",
            });
        }
        let closed: Vec<usize> = (0..contact).filter(|&p| stiffness[p] > 0.0).collect();
        let held = self.rigid.columns();
        let count = held + self.omega.len();
        let mode = |port: usize, r: usize| {
            if r < held {
                self.rigid[(port, r)]
            } else {
                self.shapes[(port, r - held)]
            }
        };
        let residual = self.residual_at(omega);
        let flexibility = Matrix::from_fn(closed.len(), closed.len(), |i, j| {
            let own = if i == j {
                1.0 / stiffness[closed[i]]
            } else {
                0.0
            };
            own + residual[(closed[i], closed[j])]
        });
        let fail = |matrix| move |source| StructureError::Factorization { matrix, source };
        let factor = flexibility
            .cholesky()
            .map_err(fail("the flexibility of springs and residual"))?;
        let mut at_springs = Matrix::from_fn(closed.len(), count, |i, r| mode(closed[i], r));
        factor.solve_lower(&mut at_springs);
        let mut modal = at_springs.transpose_times(&at_springs);
        for r in held..count {
            modal[(r, r)] += self.omega[r - held].powi(2);
        }
        let (values, vectors) = modal.symmetric_eigen().map_err(fail("the sprung modes"))?;
        Ok(SprungModes {
            omega: values.iter().map(|v| v.max(0.0).sqrt()).collect(),
            vectors,
        })
    }
}

impl Reduced {
    /// With a spring of a `stiffness` \[N/m\] that pulls at ports with these parts of its force, positive where it is longer. Beyond the kept modes it
    /// is right statically and to first order in ω² at the ports, and statically in the shapes of the modes.
    ///
    /// # Errors
    /// [`StructureError::Factorization`] for modes that are not found.
    pub fn with_spring(
        &self,
        forces: &[(usize, f64)],
        stiffness: f64,
    ) -> Result<Reduced, StructureError> {
        let (ports, held) = (self.ports.len(), self.rigid.columns());
        let modes = held + self.omega.len();
        let shape = |port: usize, r: usize| match r.checked_sub(held) {
            None => self.rigid[(port, r)],
            Some(elastic) => self.shapes[(port, elastic)],
        };
        let along =
            |of: &dyn Fn(usize) -> f64| -> f64 { forces.iter().map(|&(p, f)| f * of(p)).sum() };
        let lengthened: Vec<f64> = (0..modes).map(|r| along(&|p| shape(p, r))).collect();
        let residual: Vec<f64> = (0..ports)
            .map(|port| along(&|p| self.residual[(port, p)]))
            .collect();
        let force = stiffness / (1.0 + stiffness * along(&|p| residual[p]));
        let square = |r: usize| {
            r.checked_sub(held)
                .map_or(0.0, |elastic| self.omega[elastic].powi(2))
        };
        let modal = Matrix::from_fn(modes, modes, |r, s| {
            let own = if r == s { square(r) } else { 0.0 };
            own + force * lengthened[r] * lengthened[s]
        });
        let fail = |source| StructureError::Factorization {
            matrix: "the modes with a spring",
            source,
        };
        let (values, vectors) = modal.symmetric_eigen().map_err(fail)?;
        let bent = Matrix::from_fn(ports, modes, |p, r| {
            shape(p, r) - force * residual[p] * lengthened[r]
        });
        let shapes = bent.times(&vectors);
        let strains_rigid = lengthened[..held]
            .iter()
            .any(|l| l.abs() > HELD / self.mass.sqrt());
        let held = held - usize::from(strains_rigid);
        // (1 − s R₀ d dᵀ) R₁ (1 − s d dᵀ R₀), with the parts d of the force.
        let slope: Vec<f64> = (0..ports)
            .map(|port| along(&|p| self.residual_slope[(port, p)]))
            .collect();
        let twice = force * force * along(&|p| slope[p]);
        let residual_slope = Matrix::from_fn(ports, ports, |a, b| {
            self.residual_slope[(a, b)] - force * (residual[a] * slope[b] + slope[a] * residual[b])
                + twice * residual[a] * residual[b]
        });
        Ok(Reduced {
            rigid: shapes.columns_of(0..held),
            omega: values[held..].iter().map(|v| v.max(0.0).sqrt()).collect(),
            shapes: shapes.columns_of(held..modes),
            residual: Matrix::from_fn(ports, ports, |a, b| {
                self.residual[(a, b)] - force * residual[a] * residual[b]
            }),
            residual_slope,
            damping: (self.damping.as_ref())
                .map(|damping| vectors.transpose_times(&damping.times(&vectors))),
            hysteretic: (self.hysteretic.as_ref())
                .map(|damping| vectors.transpose_times(&damping.times(&vectors))),
            checked: None,
            ..self.clone()
        })
    }
}

/// Modes of the reduced structure with springs at its contact.
#[derive(Debug, Clone, PartialEq)]
pub struct SprungModes {
    /// Angular frequencies \[rad/s\], ascending; the first ones are the rigid modes, zero but for rounding.
    pub omega: Vec<f64>,
    /// Orthonormal columns over (rigid, elastic) modes of the unsprung structure. A damping matrix for its modal coordinates that
    /// gives each sprung mode the ratio ζ is V·diag(2ζω)·Vᵀ.
    pub vectors: Matrix,
}
