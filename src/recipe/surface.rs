//! Where a surface comes from, and which cells of a grid belong to the joint.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::Reasons;
use crate::grid::{Grid, Patch};
use crate::model_update::{ContactElements, ModelUpdateError};
use crate::structure::reduction::ContactPorts;
use crate::surface::SurfaceError;
use crate::surface::generate::{self, GeneratedSurface, RandomSurface, Spectrum};
use crate::surface::prepare::{Detrend, Fill};
use crate::surface::readers::Correction;

/// The cells of a rough joint and its unworn heights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Side lengths along x and y \[m\].
    pub size: [f64; 2],
    /// Cells along x and y.
    pub grid: [usize; 2],
    /// Which of them belong to the joint.
    pub cells: Cells,
    /// How many that are; of a measured surface fewer may have a height.
    pub kept: usize,
    /// Where the heights come from.
    pub heights: Heights,
    /// Hash of the file that they come from; none of a surface that is generated.
    pub content: Option<String>,
    /// The reasons.
    pub why: Reasons,
}

impl Surface {
    /// The grid.
    pub fn grid(&self) -> Grid {
        Grid::over(self.size, self.grid)
    }
}

/// Fewer cells a side than this resolve no roughness: a joint has no half of its grid with fewer.
pub const FEWEST_CELLS: usize = 32;

/// Which cells of a grid belong to a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Cells {
    /// All of them.
    All,
    /// Those whose centre lies outside of a round hole in the middle.
    Hole {
        /// Diameter \[m\].
        diameter: f64,
    },
    /// Those whose centre lies in a contact element.
    Elements {
        /// Elements along x and y, were there no hole.
        counts: [usize; 2],
        /// Those of them that are in the hole.
        absent: Vec<[usize; 2]>,
        /// What a contact element is: one of these, or a node between them.
        ports: ContactPorts,
    },
}

/// Where the heights come from: positive towards the other body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Heights {
    /// Gaussian heights with a Gaussian autocorrelation, exp(−(x²/clx² + y²/cly²)).
    Gaussian {
        /// Root mean square height \[m\].
        rq: f64,
        /// Lengths along x and y at which the autocorrelation is 1/e \[m\].
        correlation_length: [f64; 2],
        /// Seed of the random stream.
        seed: u64,
    },
    /// Gaussian heights with an exponential autocorrelation.
    Exponential {
        /// Root mean square height \[m\].
        rq: f64,
        /// Lengths along x and y at which the autocorrelation is 1/e \[m\].
        correlation_length: [f64; 2],
        /// Seed of the random stream.
        seed: u64,
    },
    /// Gaussian heights with a self-affine power spectrum.
    SelfAffine {
        /// Root mean square height \[m\].
        rq: f64,
        /// Hurst exponent.
        hurst: f64,
        /// Wavelength above which the spectrum is flat \[m\].
        rolloff_wavelength: f64,
        /// Wavelength below which there is no roughness \[m\]; none: down to the grid.
        cutoff_wavelength: Option<f64>,
        /// Seed of the random stream.
        seed: u64,
    },
    /// A perfectly flat surface.
    Flat,
    /// A sphere with its apex at height 0 in the middle of the joint.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// Heights from a file.
    File(HeightsFile),
}

/// Heights from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeightsFile {
    /// The file, absolute; where it stands is not part of a recipe.
    #[serde(skip)]
    pub path: PathBuf,
    /// Metres per unit of height, for a file that does not carry its unit.
    pub unit: Option<f64>,
    /// What is subtracted from the heights.
    pub detrend: Detrend,
    /// What becomes of points without a height.
    pub fill: Fill,
    /// Distance of the points along x and y \[m\], in place of what the file says.
    pub spacing: Option<[f64; 2]>,
    /// Whether x and y of the map are exchanged.
    #[serde(default, skip_serializing_if = "is_false")]
    pub transpose: bool,
    /// The unit and spacing that take the place of those in the file.
    #[serde(default, skip_serializing_if = "Correction::is_none")]
    pub correct: Correction,
    /// The second of two faces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second: Option<SecondFace>,
}

fn is_false(value: &bool) -> bool {
    !*value
}

/// The second of two measured faces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SecondFace {
    /// The file, absolute; where it stands is not part of a recipe.
    #[serde(skip)]
    pub path: PathBuf,
    /// Metres per unit of height, for a file that does not carry its unit.
    pub unit: Option<f64>,
    /// Distance of the points along x and y \[m\], in place of what the file says.
    pub spacing: Option<[f64; 2]>,
    /// Whether x and y of the map are exchanged.
    pub transpose: bool,
    /// How the map is turned over.
    pub mirror: Mirror,
    /// Its displacement along x and y of the joint, after the map is turned over \[m\].
    pub shift: [f64; 2],
    /// Hash of the file.
    pub content: Option<String>,
}

/// How the map of a second face is turned over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mirror {
    /// Not at all.
    None,
    /// Along x: h(Lx − x, y).
    X,
    /// Along y: h(x, Ly − y).
    Y,
}

impl Heights {
    /// The file that the heights come from.
    pub fn file(&self) -> Option<&HeightsFile> {
        match self {
            Heights::File(file) => Some(file),
            _ => None,
        }
    }

    /// The same, to be changed.
    pub fn file_mut(&mut self) -> Option<&mut HeightsFile> {
        match self {
            Heights::File(file) => Some(file),
            _ => None,
        }
    }

    /// Root mean square height \[m\] that is asked for.
    pub fn rq(&self) -> Option<f64> {
        match self {
            Heights::Gaussian { rq, .. }
            | Heights::Exponential { rq, .. }
            | Heights::SelfAffine { rq, .. } => Some(*rq),
            Heights::Flat | Heights::Sphere { .. } | Heights::File(_) => None,
        }
    }

    /// Lengths along x and y at which the autocorrelation is 1/e \[m\], where they are asked for.
    pub fn correlation_length(&self) -> Option<[f64; 2]> {
        match self {
            Heights::Gaussian {
                correlation_length, ..
            }
            | Heights::Exponential {
                correlation_length, ..
            } => Some(*correlation_length),
            _ => None,
        }
    }

    /// Wavelength above which a spectrum is flat \[m\], of a self-affine surface.
    pub fn rolloff_wavelength(&self) -> Option<f64> {
        match self {
            Heights::SelfAffine {
                rolloff_wavelength, ..
            } => Some(*rolloff_wavelength),
            _ => None,
        }
    }

    /// Radius of a sphere \[m\].
    pub fn sphere_radius(&self) -> Option<f64> {
        match self {
            Heights::Sphere { radius } => Some(*radius),
            _ => None,
        }
    }

    /// The heights on a patch; none where they come from a file.
    ///
    /// # Errors
    /// [`SurfaceError`] for numbers without sense, or too few cells for them.
    pub fn generate(&self, patch: &Patch) -> Result<Option<GeneratedSurface>, SurfaceError> {
        let exact = |heights| GeneratedSurface {
            heights,
            warnings: Vec::new(),
        };
        match (self, self.random()) {
            (Heights::Flat, _) => Ok(Some(exact(generate::flat(patch)))),
            (Heights::Sphere { radius }, _) => Ok(Some(exact(generate::sphere(patch, *radius)?))),
            (_, Some(surface)) => generate::random(patch, &surface).map(Some),
            (_, None) => Ok(None),
        }
    }

    /// Refuses heights that no grid as this one shows any of.
    ///
    /// # Errors
    /// [`SurfaceError::NoPower`]
    pub fn check_on(&self, grid: &Grid) -> Result<(), SurfaceError> {
        match self.random() {
            Some(surface) => generate::check_power(grid, &surface.spectrum),
            None => Ok(()),
        }
    }

    /// What a random surface is drawn from.
    fn random(&self) -> Option<RandomSurface> {
        let (rq, spectrum, seed) = match self {
            Heights::Flat | Heights::Sphere { .. } | Heights::File(_) => return None,
            Heights::Gaussian {
                rq,
                correlation_length,
                seed,
            } => {
                let correlation_length = *correlation_length;
                (rq, Spectrum::Gaussian { correlation_length }, seed)
            }
            Heights::Exponential {
                rq,
                correlation_length,
                seed,
            } => {
                let correlation_length = *correlation_length;
                (rq, Spectrum::Exponential { correlation_length }, seed)
            }
            Heights::SelfAffine {
                rq,
                hurst,
                rolloff_wavelength,
                cutoff_wavelength,
                seed,
            } => {
                let spectrum = Spectrum::SelfAffine {
                    hurst: *hurst,
                    rolloff_wavelength: *rolloff_wavelength,
                    cutoff_wavelength: *cutoff_wavelength,
                };
                (rq, spectrum, seed)
            }
        };
        Some(RandomSurface {
            rq: *rq,
            spectrum,
            seed: *seed,
        })
    }

    /// Seed of the random stream, of a surface that has one.
    pub fn seed(&self) -> Option<u64> {
        match self {
            Heights::Gaussian { seed, .. }
            | Heights::Exponential { seed, .. }
            | Heights::SelfAffine { seed, .. } => Some(*seed),
            Heights::Flat | Heights::Sphere { .. } | Heights::File(_) => None,
        }
    }
}

impl Cells {
    /// Diameter of a round hole \[m\]; none of a joint without.
    pub fn hole_diameter(&self) -> Option<f64> {
        match self {
            Cells::Hole { diameter } => Some(*diameter),
            Cells::All | Cells::Elements { .. } => None,
        }
    }

    /// Contact elements along x and y; none of a joint without.
    pub fn element_counts(&self) -> [usize; 2] {
        match self {
            Cells::Elements { counts, .. } => *counts,
            Cells::All | Cells::Hole { .. } => [0; 2],
        }
    }
}

impl Surface {
    /// The contact elements whose cells are those of the joint, if they are.
    ///
    /// # Errors
    /// [`ModelUpdateError`] where the grid is coarser than the elements.
    pub fn contact_elements(&self) -> Result<Option<ContactElements>, ModelUpdateError> {
        let Cells::Elements {
            counts,
            absent,
            ports,
        } = &self.cells
        else {
            return Ok(None);
        };
        let all = (0..counts[0]).flat_map(|i| (0..counts[1]).map(move |j| [i, j]));
        let cells: Vec<[usize; 2]> = all.filter(|cell| !absent.contains(cell)).collect();
        let elements = match ports {
            ContactPorts::Faces => ContactElements::new(self.grid(), *counts, &cells),
            ContactPorts::Nodes => ContactElements::at_nodes(self.grid(), *counts, &cells),
        };
        elements.map(Some)
    }

    /// The grid and the cells of it that belong to the joint.
    ///
    /// # Errors
    /// As for [`Surface::contact_elements`].
    pub fn patch(&self) -> Result<Patch, ModelUpdateError> {
        Ok(match (self.contact_elements()?, &self.cells) {
            (Some(elements), _) => elements.patch().clone(),
            (None, Cells::Hole { diameter }) => Patch::with_hole(self.grid(), *diameter),
            (None, _) => Patch::full(self.grid()),
        })
    }
}
