//! The reduced model: modes, and the static residual of all higher modes, at the ports.
//!
//! A *port* is a combination of displacements where a force can act. The first ports are the relative displacements of
//! the contact elements, upper body minus lower body. The relative displacement of a contact element is the
//! displacement of one pair of nodes, or the mean over the four pairs of a face. The ports of the drive and response
//! points follow the ports of the contact elements. With unit forces on the ports the receptance is
//!
//! H(ω) = Σ_rigid φφᵀ/(−ω²) + Σ_r φφᵀ/(ω_r² − ω² + 2iζω_rω) + R₀ + ω²R₁.
//!
//! R₀ + ω²R₁ approximates the modes above the n kept modes: Σ_{r>n} φφᵀ/(ω_r² − ω²) = R₀ + ω²R₁ + O(ω⁴/ω_n⁴). R₀ is the
//! residual flexibility of MacNeal (Comput. Struct. 1, 1971). The residual mass of Rubin (AIAA J. 13, 1975) follows
//! from R₁.
//!
//! The residual is the flexibility of K + s·M minus the share of the kept modes. The residual is computed for two
//! shifts s. Because of the shift s, the rigid modes need no support. The ports are eliminated last. The flexibility of
//! the ports is therefore a small dense factor and needs no solve per port.
//!
//! A force on a port acts along the displacement of the port. A positive force on a contact port pulls the upper body
//! along the positive axis and the lower body along the negative axis. A positive force on a contact port along z opens
//! the joint.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::linalg::{LinalgError, Matrix, SparseCholesky};
use crate::structure::StructureError;
use crate::structure::assembly::{Combination, System};
use crate::structure::mesh::Point;
use crate::structure::modes::{ModeOptions, ShiftSettings, lowest, rigid_modes, shift};
use crate::structure::resonator::FacingFaces;

/// Frequency at which the reduced model is compared with the whole structure, as a share of the highest kept frequency.
/// Relevant harmonics have frequencies below `CHECK_FREQUENCY_RATIO` times the highest kept frequency.
const CHECK_FREQUENCY_RATIO: f64 = 0.5;

/// A spring constrains a rigid mode if the mode changes the length of the spring by more than a threshold. The
/// threshold is `CONSTRAINED` divided by the square root of the mass of the structure.
const CONSTRAINED: f64 = 1e-6;

/// Kind of contact element of a structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactPorts {
    /// A face between four pairs of nodes. The displacement of the face is the mean of the displacements of the four
    /// pairs. Each pair of nodes bears a quarter of the force on the face.
    #[default]
    Faces,
    /// A pair of nodes, with a quarter of each face around it.
    Nodes,
}

impl ContactPorts {
    /// Returns true for faces. A recipe stores [`ContactPorts::Nodes`], but omits the default value
    /// [`ContactPorts::Faces`].
    pub fn are_faces(&self) -> bool {
        *self == ContactPorts::Faces
    }
}

/// Ports of a structure. Each contact element has three ports along x, y and z. After the contact elements, each point
/// has three ports.
#[derive(Debug, Clone, PartialEq)]
pub struct Ports {
    /// Degrees of freedom and weights of each port.
    pub combinations: Vec<Combination>,
    /// Number of contact elements. Contact element e has the ports 3e, 3e + 1 and 3e + 2.
    pub contacts: usize,
    /// Names of the points, in order.
    pub points: Vec<String>,
}

impl Ports {
    /// Defines the ports of contact elements and points.
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
                let terms = pairs.iter().flat_map(|&(lower, upper)| {
                    [(3 * lower + axis, -share), (3 * upper + axis, share)]
                });
                combinations.push(terms.collect());
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

    /// Returns the number of ports.
    pub fn len(&self) -> usize {
        self.combinations.len()
    }

    /// Returns true if there are no ports.
    pub fn is_empty(&self) -> bool {
        self.combinations.is_empty()
    }

    /// Returns the number of contact ports, which come first.
    pub fn contact_ports(&self) -> usize {
        3 * self.contacts
    }

    /// Returns the port of a point along an axis. The numbers 0, 1 and 2 are the axes x, y and z.
    pub fn of_point(&self, name: &str, axis: usize) -> Option<usize> {
        let place = self.points.iter().position(|p| p == name)?;
        Some(self.contact_ports() + 3 * place + axis)
    }

    /// Returns the nodes that the ports use, in ascending order, or an error if a node does not exist.
    fn checked_nodes(&self, system: &System) -> Result<Vec<usize>, StructureError> {
        let dofs = self.combinations.iter().flatten();
        let mut nodes: Vec<usize> = dofs.map(|&(dof, _)| dof / 3).collect();
        nodes.sort_unstable();
        nodes.dedup();
        match nodes.last() {
            Some(&index) if index >= system.coordinates.len() => {
                Err(StructureError::DoesNotExist {
                    what: "node",
                    index,
                    count: system.coordinates.len(),
                })
            }
            _ => Ok(nodes),
        }
    }

    /// Computes the displacements of the ports, one row each, from the displacements of all degrees of freedom.
    pub(super) fn displacements(&self, shapes: &Matrix) -> Matrix {
        Matrix::from_fn(self.len(), shapes.columns(), |port, c| {
            let column = shapes.column(c);
            let terms = self.combinations[port].iter();
            terms.map(|&(dof, weight)| weight * column[dof]).sum()
        })
    }
}

/// Reduced structure: the ports of a structure, with their modes and residual flexibility.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedStructure {
    /// The ports, in the order of the rows below.
    pub ports: Ports,
    /// Rigid modes at the ports \[kg^-1/2\], one column each. Contact ports of connected bodies have zeros.
    pub rigid: Matrix,
    /// Angular frequencies of the elastic modes \[rad/s\], ascending.
    pub omega: Vec<f64>,
    /// Elastic modes at the ports \[kg^-1/2\], one column each.
    pub shapes: Matrix,
    /// Static residual R₀ \[m/N\], symmetric, port by port.
    pub residual: Matrix,
    /// Slope R₁ of the residual over ω² \[m s²/N\], symmetric, port by port.
    pub residual_slope: Matrix,
    /// Viscous damping between the modes, rigid ones first \[1/s\]. `None` without viscous damping of the structure.
    pub damping: Option<Matrix>,
    /// Hysteretic damping between the modes, rigid ones first \[1/s²\]. `None` without hysteretic damping of the
    /// structure.
    pub hysteretic: Option<Matrix>,
    /// Mass of the structure \[kg\].
    pub mass: f64,
    /// Largest relative residual of the modes.
    pub mode_residual: f64,
    /// Number of entries of the sparse factor, eight bytes each.
    pub factor_entries: usize,
    /// Flexibility of the whole structure at another shift. `None` for a reduced structure that is read from a file.
    pub reference: Option<ReferenceFlexibility>,
}

/// Flexibility of the whole structure at a shift that the reduction does not use. The flexibility at the unused shift
/// shows the error of the reduction.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceFlexibility {
    /// The shift s \[rad²/s²\].
    pub shift: f64,
    /// Bᵀ(K + sM)⁻¹B \[m/N\], symmetric, port by port.
    pub flexibility: Matrix,
}

impl ReferenceFlexibility {
    /// Returns the imaginary frequency that corresponds to the shift \[Hz\].
    pub fn frequency(&self) -> f64 {
        self.shift.sqrt() / std::f64::consts::TAU
    }
}

/// Reduces the structure `system` to its ports.
///
/// # Errors
/// [`StructureError`] if a node of a port does not exist or if the modes do not converge. [`StructureError`] if the
/// stiffness is not positive.
pub fn reduce(
    system: &System,
    ports: Ports,
    options: &ModeOptions,
) -> Result<ReducedStructure, StructureError> {
    reduce_with_shapes(system, ports, &[], options).map(|(reduced, _)| reduced)
}

/// Reduces the structure `system` to its ports and returns the modes of the structure \[kg^-1/2\] at `nodes`. The
/// matrix of the modes has three rows per node (x, y, z) and one column per mode, rigid modes first.
///
/// # Errors
/// As [`reduce`].
///
/// # Panics
/// If a node in `nodes` does not exist.
pub fn reduce_with_shapes(
    system: &System,
    ports: Ports,
    nodes: &[usize],
    options: &ModeOptions,
) -> Result<(ReducedStructure, Matrix), StructureError> {
    let shown_nodes = nodes;
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
    let rigid_count = rigid_shapes.columns();
    let at_nodes = Matrix::from_fn(
        3 * shown_nodes.len(),
        rigid_count + shapes.columns(),
        |row, mode| {
            let dof = 3 * shown_nodes[row / 3] + row % 3;
            match mode.checked_sub(rigid_count) {
                None => rigid_shapes[(dof, mode)],
                Some(elastic) => modes.shapes[(dof, elastic)],
            }
        },
    );
    let modes_at_ports = ModesAtPorts {
        rigid_squares: vec![0.0; rigid.columns()],
        rigid,
        omega: modes.omega,
        shapes,
        residual: modes.residuals.iter().copied().fold(0.0, f64::max),
    };
    let count = 3 * nodes.len();
    let reduced = reduce_with_modes(
        ports,
        modes_at_ports,
        system.total_mass(),
        (factor, small, count),
        |shift| system.shifted_factor(shift, &order),
    )?;
    Ok((reduced, at_nodes))
}

/// Kept modes of a structure at its ports.
pub(super) struct ModesAtPorts {
    /// Rigid modes \[kg^-1/2\], one column each.
    pub rigid: Matrix,
    /// ω² of the rigid modes \[rad²/s²\], nonzero only by rounding of the stiffness. The reduction subtracts the rigid
    /// modes with `rigid_squares`, so that the residual does not contain the rounding of the stiffness.
    pub rigid_squares: Vec<f64>,
    /// Angular frequencies of the elastic modes \[rad/s\], ascending.
    pub omega: Vec<f64>,
    /// Elastic modes \[kg^-1/2\], one column each.
    pub shapes: Matrix,
    /// Largest relative residual of the elastic modes.
    pub residual: f64,
}

/// Computes the reduced structure from the kept modes and the flexibility of the ports.
///
/// The first factor is the factor of K + shift·M, and its last `count` rows are the rows of the ports. `refactor`
/// returns the factor for another shift.
pub(super) fn reduce_with_modes(
    ports: Ports,
    modes: ModesAtPorts,
    mass: f64,
    (factor, small, count): (SparseCholesky, f64, usize),
    refactor: impl Fn(f64) -> Result<SparseCholesky, StructureError>,
) -> Result<ReducedStructure, StructureError> {
    let ModesAtPorts {
        rigid,
        rigid_squares,
        omega,
        shapes,
        residual: mode_residual,
    } = modes;
    let flexibility_above = |factor: &SparseCholesky, shift: f64| {
        let mut flexibility = port_flexibility(factor, &ports, count);
        subtract_modes(&mut flexibility, &rigid, |r| {
            1.0 / (rigid_squares[r] + shift)
        });
        subtract_modes(&mut flexibility, &shapes, |r| {
            1.0 / (omega[r].powi(2) + shift)
        });
        flexibility
    };
    let factor_entries = factor.entries();
    let highest = omega[omega.len() - 1];
    let step = ShiftSettings::DEFAULT.slope_share * highest * highest;
    // The first factor is dropped before the next one, since two factors would be the peak of memory.
    let (near, small) = if small <= step {
        let near = flexibility_above(&factor, small);
        drop(factor);
        (near, small)
    } else {
        // The shift that computed the modes may be too large for the series of the residual about shift zero.
        drop(factor);
        (flexibility_above(&refactor(step)?, step), step)
    };
    let large = small + step;
    let far = flexibility_above(&refactor(large)?, large);
    // R(−s) = R₀ − s R₁ at both shifts.
    let mut residual_slope = Matrix::zeros(ports.len(), ports.len());
    residual_slope.add(1.0 / (large - small), &near);
    residual_slope.add(-1.0 / (large - small), &far);
    let mut residual = near;
    residual.add(small, &residual_slope);
    let shift = (CHECK_FREQUENCY_RATIO * highest).powi(2);
    let checked = ReferenceFlexibility {
        shift,
        flexibility: port_flexibility(&refactor(shift)?, &ports, count),
    };
    Ok(ReducedStructure {
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
        reference: Some(checked),
        ports,
    })
}

/// Computes the static displacements of the ports under unit forces on them: Bᵀ K⁻¹ B \[m/N\], symmetric, port by
/// port. The structure must be supported; springs to the ground suffice.
///
/// # Errors
/// [`StructureError`] for a structure with rigid modes, and for a port with a node that does not exist.
pub fn flexibility(system: &System, ports: &Ports) -> Result<Matrix, StructureError> {
    let nodes = ports.checked_nodes(system)?;
    let factor = system.shifted_factor(0.0, &system.elimination_order(&nodes))?;
    Ok(port_flexibility(&factor, ports, 3 * nodes.len()))
}

/// Computes Bᵀ A⁻¹ B for the columns B of the ports, from the last `count` rows of the factor of A.
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

/// Subtracts Σ weight·φφᵀ over the columns of `shapes` from a flexibility.
pub fn subtract_modes(flexibility: &mut Matrix, shapes: &Matrix, weight: impl Fn(usize) -> f64) {
    let weighted = Matrix::from_fn(shapes.columns(), shapes.rows(), |r, port| {
        weight(r) * shapes[(port, r)]
    });
    flexibility.add_product(-1.0, shapes, &weighted);
}

impl ReducedStructure {
    /// Returns the residual R₀ + ω²R₁ \[m/N\] at an angular frequency. The residual is nearly constant over a narrow
    /// band.
    pub fn residual_at(&self, omega: f64) -> Matrix {
        let mut residual = self.residual.clone();
        residual.add(omega * omega, &self.residual_slope);
        residual
    }

    /// Computes the receptance \[m/N\] of all ports at angular frequency `omega` > 0 with a modal damping ratio ζ.
    ///
    /// Returns the real and the imaginary part of the receptance for e^{+iωt}, so a lag has a negative imaginary part.
    /// Rigid modes and the residual are undamped.
    pub fn receptance(&self, omega: f64, damping_ratio: f64) -> (Matrix, Matrix) {
        let squared = omega * omega;
        let mut real = self.residual_at(omega);
        let mut imaginary = Matrix::zeros(self.ports.len(), self.ports.len());
        subtract_modes(&mut real, &self.rigid, |_| 1.0 / squared);
        let denominator = |r: usize| {
            let stiff = self.omega[r].powi(2) - squared;
            let damped = 2.0 * damping_ratio * self.omega[r] * omega;
            let size = stiff * stiff + damped * damped;
            (stiff / size, damped / size)
        };
        subtract_modes(&mut real, &self.shapes, |r| -denominator(r).0);
        if damping_ratio != 0.0 {
            subtract_modes(&mut imaginary, &self.shapes, |r| denominator(r).1);
        }
        (real, imaginary)
    }

    /// Computes the modes of the structure with springs on its contact ports, which models a sticking joint.
    ///
    /// `stiffness` has one value per contact port \[N/m\], in their order. Zero means no spring, and infinity bonds
    /// the port. The modal stiffness is Ω² + Φᵀ(k⁻¹ + R)⁻¹Φ over rigid and elastic modes. The residual R is evaluated
    /// at angular frequency `omega`, so modes near it are the most accurate.
    ///
    /// # Errors
    /// [`StructureError`] if the numbers of stiffnesses and contact ports differ, or if a stiffness is negative.
    pub fn with_springs(
        &self,
        stiffness: &[f64],
        omega: f64,
    ) -> Result<SprungModes, StructureError> {
        let contact = self.ports.contact_ports();
        if stiffness.len() != contact {
            return Err(StructureError::Contradiction {
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
        let sprung_ports: Vec<usize> = (0..contact).filter(|&p| stiffness[p] > 0.0).collect();
        let rigid_count = self.rigid.columns();
        let count = rigid_count + self.omega.len();
        let mode = |port: usize, r: usize| {
            if r < rigid_count {
                self.rigid[(port, r)]
            } else {
                self.shapes[(port, r - rigid_count)]
            }
        };
        let residual = self.residual_at(omega);
        let flexibility = Matrix::from_fn(sprung_ports.len(), sprung_ports.len(), |i, j| {
            let spring_flexibility = if i == j {
                1.0 / stiffness[sprung_ports[i]]
            } else {
                0.0
            };
            spring_flexibility + residual[(sprung_ports[i], sprung_ports[j])]
        });
        let fail = |matrix| move |source| StructureError::Factorization { matrix, source };
        let factor = flexibility
            .cholesky()
            .map_err(fail("the flexibility of springs and residual"))?;
        let mut at_springs =
            Matrix::from_fn(sprung_ports.len(), count, |i, r| mode(sprung_ports[i], r));
        factor.solve_lower(&mut at_springs);
        let mut modal = at_springs.transpose_times(&at_springs);
        for r in rigid_count..count {
            modal[(r, r)] += self.omega[r - rigid_count].powi(2);
        }
        let (values, vectors) = modal.symmetric_eigen().map_err(fail("the sprung modes"))?;
        Ok(SprungModes {
            omega: values.iter().map(|v| v.max(0.0).sqrt()).collect(),
            vectors,
        })
    }
}

impl ReducedStructure {
    /// Adds a spring of a `stiffness` \[N/m\] to the reduced structure.
    ///
    /// `forces` are the parts of the spring's force on ports, positive where the port's displacement lengthens the
    /// spring. The displacements of the ports include the modes beyond the kept modes exactly in statics and to first
    /// order in ω². The shapes of the modes include the modes beyond the kept modes exactly in statics only.
    ///
    /// # Errors
    /// [`StructureError::Factorization`] if the modes are not found.
    pub fn with_spring(
        &self,
        forces: &[(usize, f64)],
        stiffness: f64,
    ) -> Result<ReducedStructure, StructureError> {
        let (ports, rigid_count) = (self.ports.len(), self.rigid.columns());
        let modes = rigid_count + self.omega.len();
        let shape = |port: usize, r: usize| match r.checked_sub(rigid_count) {
            None => self.rigid[(port, r)],
            Some(elastic) => self.shapes[(port, elastic)],
        };
        let along = |displacement: &dyn Fn(usize) -> f64| -> f64 {
            forces.iter().map(|&(p, f)| f * displacement(p)).sum()
        };
        let elongations: Vec<f64> = (0..modes).map(|r| along(&|p| shape(p, r))).collect();
        let residual: Vec<f64> = (0..ports)
            .map(|port| along(&|p| self.residual[(port, p)]))
            .collect();
        let force = stiffness / (1.0 + stiffness * along(&|p| residual[p]));
        let square = |r: usize| {
            r.checked_sub(rigid_count)
                .map_or(0.0, |elastic| self.omega[elastic].powi(2))
        };
        let modal = Matrix::from_fn(modes, modes, |r, s| {
            let diagonal = if r == s { square(r) } else { 0.0 };
            diagonal + force * elongations[r] * elongations[s]
        });
        let fail = |source| StructureError::Factorization {
            matrix: "the modes with a spring",
            source,
        };
        let (values, vectors) = modal.symmetric_eigen().map_err(fail)?;
        let corrected_shapes = Matrix::from_fn(ports, modes, |p, r| {
            shape(p, r) - force * residual[p] * elongations[r]
        });
        let shapes = corrected_shapes.times(&vectors);
        let constrains_rigid = elongations[..rigid_count]
            .iter()
            .any(|l| l.abs() > CONSTRAINED / self.mass.sqrt());
        let rigid_count = rigid_count - usize::from(constrains_rigid);
        // The slope of the residual is (1 − s R₀ d dᵀ) R₁ (1 − s d dᵀ R₀). The vector d has the parts of the force, and
        // s is `force`.
        let slope: Vec<f64> = (0..ports)
            .map(|port| along(&|p| self.residual_slope[(port, p)]))
            .collect();
        let quadratic = force * force * along(&|p| slope[p]);
        let residual_slope = Matrix::from_fn(ports, ports, |a, b| {
            self.residual_slope[(a, b)] - force * (residual[a] * slope[b] + slope[a] * residual[b])
                + quadratic * residual[a] * residual[b]
        });
        Ok(ReducedStructure {
            rigid: shapes.column_range(0..rigid_count),
            omega: values[rigid_count..]
                .iter()
                .map(|v| v.max(0.0).sqrt())
                .collect(),
            shapes: shapes.column_range(rigid_count..modes),
            residual: Matrix::from_fn(ports, ports, |a, b| {
                self.residual[(a, b)] - force * residual[a] * residual[b]
            }),
            residual_slope,
            damping: (self.damping.as_ref())
                .map(|damping| vectors.transpose_times(&damping.times(&vectors))),
            hysteretic: (self.hysteretic.as_ref())
                .map(|damping| vectors.transpose_times(&damping.times(&vectors))),
            reference: None,
            ..self.clone()
        })
    }
}

/// Modes of the reduced structure with springs at its contact.
#[derive(Debug, Clone, PartialEq)]
pub struct SprungModes {
    /// Angular frequencies \[rad/s\], ascending. The rigid modes come first and are zero except for rounding.
    pub omega: Vec<f64>,
    /// Orthonormal columns over the (rigid, elastic) modes of the structure without springs. In the coordinates of the
    /// modes without springs, the damping matrix V·diag(2ζω)·Vᵀ gives each mode with springs the damping ratio ζ.
    pub vectors: Matrix,
}
