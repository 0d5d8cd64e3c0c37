//! A rough contact before it is solved: what theory says of its area, pressures, stiffness, slip and wear from the scene alone.
//!
//! The formulas are those of rough contacts on half spaces; factors that theory leaves open were fitted once to some 200 runs
//! of scenes drawn at random (48 x 48 to 256 x 256 cells; load, roughness, motion and wear over two to four decades) and held
//! against others. They cost nothing, and are within some ten per cent.

use std::f64::consts::PI;

use super::bearing;
use crate::contact::cell_integrals;
use crate::grid::{Grid, Patch};
use crate::scene::{Boundary, RoughJoint, Scene, Structure, Surface};
use crate::wear::Motion;

/// What is known of a surface: that a file holds it is found by reading it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    /// Root mean square height \[m\].
    pub rq: f64,
    /// Root mean square slope between neighbouring cells.
    pub gradient: f64,
}

impl Texture {
    /// Of heights on a grid, between neighbouring kept cells.
    pub fn of(patch: &Patch, height: &[f64]) -> Texture {
        let Grid { nx, ny, dx, dy } = patch.grid;
        let (mut cells, mut sum, mut squares) = (0.0f64, 0.0, 0.0);
        let (mut slopes, mut slope_count) = ([0.0f64; 2], [0.0f64; 2]);
        for c in (0..patch.grid.len()).filter(|&c| patch.kept[c]) {
            cells += 1.0;
            sum += height[c];
            squares += height[c] * height[c];
            let (i, j) = patch.grid.cell(c);
            let right = (i + 1 < nx).then(|| patch.grid.index(i + 1, j));
            let above = (j + 1 < ny).then(|| patch.grid.index(i, j + 1));
            for (axis, (next, step)) in [(right, dx), (above, dy)].into_iter().enumerate() {
                if let Some(next) = next.filter(|&next| patch.kept[next]) {
                    slopes[axis] += ((height[next] - height[c]) / step).powi(2);
                    slope_count[axis] += 1.0;
                }
            }
        }
        let mean = sum / cells.max(1.0);
        let square = |axis: usize| slopes[axis] / slope_count[axis].max(1.0);
        Texture {
            rq: (squares / cells.max(1.0) - mean * mean).max(0.0).sqrt(),
            gradient: (square(0) + square(1)).sqrt(),
        }
    }
}

/// Its shape, as far as contact cares.
enum Shape {
    Rough(Texture),
    Sphere { radius: f64 },
    Flat,
}

/// A contact before it is solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    /// Part of the joint's cells in contact, unworn and under the mean load.
    pub area: f64,
    /// Its cells, and cells across an asperity.
    pub cells: f64,
    pub across: f64,
    pub periodic: bool,
    /// How much lower the cap is than what just a few cells would feel: 0 if it is not felt, below 1.
    pub capped: f64,
    /// Mean pressure on the joint's area, and the largest one \[Pa\].
    pub nominal: f64,
    pub peak: f64,
    /// Displacement of a cell under unit pressure on itself \[m/Pa\].
    pub self_compliance: f64,
    /// Normal compliances of the joint: of the smooth patch, and what roughness adds \[m/N\].
    pub bulk: f64,
    pub roughness: f64,
    /// Displacement at which all slides, µN/kt \[m\].
    pub onset: f64,
    /// Reach of the motion over that; 0 without motion.
    pub reach: f64,
    shape: ShapeNumbers,
}

/// Numbers by which wear enlarges the contact.
#[derive(Debug, Clone, Copy)]
struct ShapeNumbers {
    /// Height that wear has to take [m]: Rq, or that of the sphere's cap.
    height: f64,
    sphere: bool,
    one_piece: bool,
}

/// 1/(E* kn √A) of a square punch: its load over E*, displacement and side, by this program.
const PUNCH: f64 = 1.18;
/// What roughness adds to the approach, over Rq: its compliance is this times Rq/N.
const ROUGH_COMPLIANCE: f64 = 0.45;
/// kt over kn of like bodies with ν = 0.3 under full stick, (2 − 2ν)/(2 − ν) [Mindlin].
const TANGENTIAL: f64 = 0.82;
/// Contact area of a Gaussian surface, A = erf(√π κ p/(2 E* h')) [Persson; κ = 2: Bush, Gibson and Thomas's √(2π) less what
/// finite areas take].
const AREA: f64 = 2.0;
/// Cells on the rim of a patch count in full: small contacts come out larger by this part of them.
const RIM: f64 = 0.55;
const RIM_AREA: f64 = 0.12;
/// Largest pressure of a rough contact over E* h', and what it grows by with the area: some three standard deviations of
/// Persson's distribution, more at the edge of the patch.
const PEAK: [f64; 2] = [1.0, 6.0];
/// A cap is felt below this part of E* h'.
const FELT_CAP: f64 = 0.35;

impl Before {
    /// Of a scene with a rough contact. `texture` is that of a surface from a file; `motion` what `[motion]` says.
    pub fn of(
        scene: &Scene,
        rough: &RoughJoint,
        patch: &Patch,
        motion: Option<&Motion>,
        texture: Option<Texture>,
    ) -> Before {
        let contact = rough.contact;
        let pair = rough.material.pair();
        let modulus = pair.effective_modulus();
        let (grid, cells) = (patch.grid, patch.cells() as f64);
        let whole = patch.area();
        let periodic = contact.boundary == Boundary::Periodic;
        let shape = shape(rough.surface, grid, texture);
        let bulk = if periodic {
            0.0
        } else {
            1.0 / (PUNCH * modulus * whole.sqrt())
        };
        // A load that is to be found is that which brings the mean planes of the bodies this close.
        let load = match contact.approach {
            None => contact.normal_load,
            Some(approach) => match shape {
                Shape::Sphere { radius } => {
                    4.0 / 3.0 * modulus * (radius * approach.max(0.0).powi(3)).sqrt()
                }
                _ => approach.max(0.0) / bulk.max(1.0 / (PUNCH * modulus * whole.sqrt())),
            },
        };
        let nominal = load / whole;
        let cap = contact.pressure_cap.unwrap_or(f64::INFINITY);
        let side = (grid.dx * grid.dy).sqrt();
        let (mut area, peak, across, roughness, height, felt) = match &shape {
            Shape::Flat => (1.0, 5.0 * nominal, 5.0, 0.0, side, 2.0 * nominal),
            Shape::Sphere { radius } => {
                let a = (0.75 * load * radius / modulus).cbrt();
                let peak = 1.5 * load / (PI * a * a).max(f64::MIN_POSITIVE);
                let own = 1.0 / (2.0 * modulus * a).max(f64::MIN_POSITIVE);
                let part = (PI * a * a / whole).min(1.0);
                (
                    part,
                    peak,
                    a / side,
                    own,
                    a * a / (2.0 * radius),
                    0.7 * peak,
                )
            }
            Shape::Rough(Texture { rq, gradient }) => {
                let scale = modulus * gradient.max(1e-12);
                let bare = bearing::erf(0.5 * PI.sqrt() * AREA * nominal / scale);
                let part = bare * (1.0 + RIM * (-bare / RIM_AREA).exp());
                let peak = scale * (PEAK[0] + PEAK[1] * part);
                let across = (2.0 * rq / (gradient * side).max(f64::MIN_POSITIVE)).clamp(1.0, 50.0);
                let own = ROUGH_COMPLIANCE * rq / load.max(f64::MIN_POSITIVE);
                (part, peak, across, own, *rq, FELT_CAP * scale)
            }
        };
        if cap.is_finite() {
            area = area.hypot(nominal / cap);
        }
        area = area.clamp(1.0 / cells.max(1.0), 1.0);
        let sphere = matches!(shape, Shape::Sphere { .. });
        let bulk = if sphere { 0.0 } else { bulk };
        // A vibration that follows the worn joint moves it, in the mean, as one that is worn by half.
        let follows = scene.dynamics.is_some() && scene.update.is_some();
        let worn = if follows { 0.5 } else { 1.0 };
        let compliance = (bulk + worn * roughness).max(f64::MIN_POSITIVE);
        let friction = contact.friction_coefficient.unwrap_or(0.0);
        // Under a sphere all slides at half as much more [Mindlin].
        let last = if sphere { 1.5 } else { 1.0 };
        let onset = last * friction * load * compliance / TANGENTIAL;
        let self_compliance = cell_integrals(0.0, 0.0, grid.dx, grid.dy).inverse / (PI * modulus);
        let reach = if scene.dynamics.is_some() {
            reach_at_resonance(scene, friction * load)
        } else {
            motion.map_or(0.0, |motion| reach(motion, onset, friction * load))
        };
        Before {
            area,
            cells,
            across,
            periodic,
            capped: (1.0 - cap / felt).max(0.0),
            nominal,
            peak: peak.min(cap).max(nominal),
            self_compliance,
            bulk,
            roughness,
            onset,
            reach,
            shape: ShapeNumbers {
                height,
                sphere,
                one_piece: !matches!(shape, Shape::Rough(_)),
            },
        }
    }

    /// Part of the joint in contact once this mean depth is worn off it \[m\]: that of a surface that is cut flat.
    pub fn area_worn(&self, depth: f64) -> f64 {
        let relative = depth / self.shape.height;
        if self.shape.sphere {
            // A sphere's worn cap has the volume πa⁴/(4R), and a²/(2R) was its height: area² grows by 2·depth/height·area.
            return (self.area * self.area + 2.0 * relative * self.area)
                .sqrt()
                .min(1.0);
        }
        bearing::area(bearing::volume_at(self.area) + relative)
    }

    /// Whether the contact is one piece rather than islands.
    pub fn one_piece(&self) -> bool {
        self.shape.one_piece
    }

    pub fn is_sphere(&self) -> bool {
        self.shape.sphere
    }

    /// How far the highest cells are cut down by then \[m\].
    pub fn cut(&self, depth: f64) -> f64 {
        if self.shape.sphere {
            return self.shape.height * (self.area_worn(depth) / self.area - 1.0) + depth;
        }
        let begin = bearing::volume_at(self.area);
        let heights = bearing::level(begin) - bearing::level(begin + depth / self.shape.height);
        self.shape.height * heights
    }

    /// Dissipated energy of a cycle over 4 µN times the onset. Below the onset it grows like the third power of the reach, as
    /// micro-slip does [Mindlin]; beyond, the joint slides by what is left.
    pub fn slides(&self) -> f64 {
        slides(self.reach)
    }

    /// Mean path of the slip in a cycle \[m\].
    pub fn slip_path(&self) -> f64 {
        let part = if self.reach > 1.5 {
            self.slides()
        } else {
            self.slides().max(0.3 * self.reach)
        };
        4.0 * self.onset * part
    }

    /// Mean depth that partial slip wears off at most, when its slip zone bears no more; unbounded where all slides \[m\].
    pub fn shakedown(&self) -> f64 {
        if self.reach < SLIDING {
            let square = self.reach * self.reach;
            let part = SHAKEDOWN[0] + SHAKEDOWN[1] * square * square;
            let capped = if self.capped > 0.0 {
                SHAKEDOWN_CAPPED
            } else {
                1.0
            };
            capped * part * self.area * square * self.shape.height
        } else {
            f64::INFINITY
        }
    }
}

/// Mean depth over area, height and reach squared at which partial slip comes to rest, and what it grows by towards gross slip;
/// and how much deeper where a cap spreads the load.
const SHAKEDOWN: [f64; 2] = [0.2, 1.2];
const SHAKEDOWN_CAPPED: f64 = 2.5;
/// Reach above which wear does not come to rest.
const SLIDING: f64 = 1.2;

fn slides(reach: f64) -> f64 {
    if reach < SLIDING {
        0.065 * reach.powi(3)
    } else {
        (reach - 1.1).max(0.112)
    }
}

/// Reach of a motion over the displacement at which all slides; a force reaches as far as the contact yields to it.
fn reach(motion: &Motion, onset: f64, limit: f64) -> f64 {
    let half_range = |values: &[f64]| {
        let (least, most) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| {
                (l.min(*v), m.max(*v))
            });
        (0.5 * (most - least)).max(0.0)
    };
    let mut square = 0.0;
    for channel in &motion.drive {
        let part = match channel {
            crate::wear::Channel::Displacement(values) => {
                half_range(values) / onset.max(f64::MIN_POSITIVE)
            }
            // Of a smooth punch's T = µN (1 − (1 − δ)^…): close to the limit the displacement runs ahead of the force.
            crate::wear::Channel::Force(values) => {
                let part = (half_range(values) / limit.max(f64::MIN_POSITIVE)).min(1.0);
                part * (1.0 + 0.5 * part * part)
            }
        };
        square += part * part;
    }
    square.sqrt().min(1e6)
}

/// Displacement of the far wall over that of the joint at the first resonance of the shipped resonator, computed there.
const MOTION_OF_WALL: f64 = 9.6;
/// The largest reach that this is good for: more is bounded by damping.
const FURTHEST: f64 = 20.0;

/// Reach of a joint at resonance: what the drive supplies in a cycle, πF u, friction takes, 4 µN·onset·slides(reach).
pub(super) fn reach_at_resonance(scene: &Scene, limit: f64) -> f64 {
    let (Some(Structure::Resonator { .. }), Some(dynamics)) = (&scene.structure, &scene.dynamics)
    else {
        return 1.0;
    };
    let force = dynamics.forces.first().map_or(0.0, |f| f.amplitude);
    let supplied = PI * force * MOTION_OF_WALL / (4.0 * limit).max(f64::MIN_POSITIVE);
    let micro = (supplied / 0.065).sqrt();
    if micro < SLIDING {
        micro
    } else if supplied < 1.0 {
        (1.1 / (1.0 - supplied)).clamp(SLIDING, FURTHEST)
    } else {
        FURTHEST
    }
}

fn shape(surface: &Surface, grid: Grid, texture: Option<Texture>) -> Shape {
    // ⟨(Δh/Δx)²⟩ = 2 Rq² (1 − ρ(Δx))/Δx² along each axis.
    let slopes = |rq: f64, correlation: [f64; 2], ends: fn(f64) -> f64| {
        let part = |step: f64, length: f64| 2.0 * ends(step / length) / (step * step);
        let sum = part(grid.dx, correlation[0]) + part(grid.dy, correlation[1]);
        Shape::Rough(Texture {
            rq,
            gradient: rq * sum.sqrt(),
        })
    };
    match surface {
        Surface::Flat => Shape::Flat,
        Surface::Sphere { radius } => Shape::Sphere { radius: *radius },
        Surface::Gaussian {
            rq,
            correlation_length,
            ..
        } => slopes(*rq, *correlation_length, |x| 1.0 - (-x * x).exp()),
        Surface::Exponential {
            rq,
            correlation_length,
            ..
        } => slopes(*rq, *correlation_length, |x| 1.0 - (-x).exp()),
        Surface::SelfAffine {
            rq,
            hurst,
            rolloff_wavelength,
            cutoff_wavelength,
            ..
        } => {
            let step = (grid.dx * grid.dy).sqrt();
            let shortest = cutoff_wavelength.unwrap_or(0.0).max(2.0 * step);
            let octaves = (rolloff_wavelength / shortest).max(1.0);
            let first = 2.0 * PI / rolloff_wavelength;
            // Moments of a spectrum that is flat to the roll-off and falls with the power −2 − 2H above it.
            let rest = 1.0 - hurst;
            let zeroth = 0.5 + (1.0 - octaves.powf(-2.0 * hurst)) / (2.0 * hurst);
            let second = 0.25
                + if rest > 1e-6 {
                    (octaves.powf(2.0 * rest) - 1.0) / (2.0 * rest)
                } else {
                    octaves.ln()
                };
            Shape::Rough(Texture {
                rq: *rq,
                gradient: GRID_SLOPE * rq * first * (second / zeroth).sqrt(),
            })
        }
        Surface::File { .. } => match texture {
            Some(texture) if texture.gradient > 0.0 => Shape::Rough(texture),
            _ => Shape::Flat,
        },
    }
}

/// Slope between neighbouring cells over that of the spectrum, down to two cells a wave.
const GRID_SLOPE: f64 = 0.75;
