//! Source of the heights of a surface, and cells of the grid that belong to the joint.

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

/// The cells of a rough joint and their unworn heights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Side lengths along x and y \[m\].
    pub size: [f64; 2],
    /// Cells along x and y.
    pub grid: [usize; 2],
    /// The cells that belong to the joint.
    pub cells: Cells,
    /// Number of these cells. In a measured surface, fewer cells may have a height.
    pub kept: usize,
    /// Source of the heights.
    pub heights: Heights,
    /// Hash of the file with the heights; `None` for a generated surface.
    pub content: Option<String>,
    /// Reasons for the choices.
    pub why: Reasons,
}

impl Surface {
    /// Returns the grid.
    pub fn grid(&self) -> Grid {
        Grid::over(self.size, self.grid)
    }
}

/// Least number of cells per side of a half grid. Fewer cells do not resolve the roughness.
pub const FEWEST_CELLS: usize = 32;

/// Cells of a grid that belong to a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Cells {
    /// All cells.
    All,
    /// Cells whose centre lies outside a round hole in the middle.
    Hole {
        /// Diameter \[m\].
        diameter: f64,
    },
    /// Cells whose centre lies in a contact element.
    Elements {
        /// Elements along x and y, including elements in the hole.
        counts: [usize; 2],
        /// Elements in the hole.
        absent: Vec<[usize; 2]>,
        /// Position of the contact elements: on the faces of the structure, or at the nodes between the faces.
        ports: ContactPorts,
    },
}

/// Source of the heights. A positive height points towards the opposite body.
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
        /// Wavelength below which there is no roughness \[m\]; `None` for roughness down to the grid.
        cutoff_wavelength: Option<f64>,
        /// Seed of the random stream.
        seed: u64,
    },
    /// A perfectly flat surface.
    Flat,
    /// A sphere whose apex has height 0 and lies in the middle of the joint.
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
    /// Absolute path of the file. The path is not part of a recipe.
    #[serde(skip)]
    pub path: PathBuf,
    /// Metres per unit of height, for a file without a unit.
    pub unit: Option<f64>,
    /// Shape that is subtracted from the heights.
    pub detrend: Detrend,
    /// Treatment of points without a height.
    pub fill: Fill,
    /// Distance of the points along x and y \[m\], which overrides the file.
    pub spacing: Option<[f64; 2]>,
    /// True if x and y of the map are exchanged.
    #[serde(default, skip_serializing_if = "is_false")]
    pub transpose: bool,
    /// Unit and spacing that override the values in the file.
    #[serde(default, skip_serializing_if = "Correction::is_empty")]
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
    /// Absolute path of the file. The path is not part of a recipe.
    #[serde(skip)]
    pub path: PathBuf,
    /// Metres per unit of height, for a file without a unit.
    pub unit: Option<f64>,
    /// Distance of the points along x and y \[m\], which overrides the file.
    pub spacing: Option<[f64; 2]>,
    /// True if x and y of the map are exchanged.
    pub transpose: bool,
    /// Axis along which the map is mirrored.
    pub mirror: Mirror,
    /// Displacement of the mirrored map along x and y of the joint \[m\].
    pub shift: [f64; 2],
    /// Hash of the file.
    pub content: Option<String>,
}

/// Axis along which the map of a second face is mirrored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mirror {
    /// The map is not mirrored.
    None,
    /// Along x: h(Lx − x, y).
    X,
    /// Along y: h(x, Ly − y).
    Y,
}

impl Heights {
    /// Returns the file with the heights.
    pub fn file(&self) -> Option<&HeightsFile> {
        match self {
            Heights::File(file) => Some(file),
            _ => None,
        }
    }

    /// Returns the file with the heights, mutably.
    pub fn file_mut(&mut self) -> Option<&mut HeightsFile> {
        match self {
            Heights::File(file) => Some(file),
            _ => None,
        }
    }

    /// Returns the requested root mean square height \[m\].
    pub fn rq(&self) -> Option<f64> {
        match self {
            Heights::Gaussian { rq, .. }
            | Heights::Exponential { rq, .. }
            | Heights::SelfAffine { rq, .. } => Some(*rq),
            Heights::Flat | Heights::Sphere { .. } | Heights::File(_) => None,
        }
    }

    /// Returns the requested lengths along x and y at which the autocorrelation is 1/e \[m\].
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

    /// Returns the wavelength above which the spectrum of a self-affine surface is flat \[m\].
    pub fn rolloff_wavelength(&self) -> Option<f64> {
        match self {
            Heights::SelfAffine {
                rolloff_wavelength, ..
            } => Some(*rolloff_wavelength),
            _ => None,
        }
    }

    /// Returns the radius of a sphere \[m\].
    pub fn sphere_radius(&self) -> Option<f64> {
        match self {
            Heights::Sphere { radius } => Some(*radius),
            _ => None,
        }
    }

    /// Generates the heights on a patch. Returns `None` if the heights come from a file.
    ///
    /// # Errors
    /// Returns [`SurfaceError`] for invalid parameters of the surface, or for a patch with too few cells.
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

    /// Rejects heights whose roughness a grid does not resolve at all.
    ///
    /// # Errors
    /// [`SurfaceError::NoPower`]
    pub fn check_on(&self, grid: &Grid) -> Result<(), SurfaceError> {
        match self.random() {
            Some(surface) => generate::check_power(grid, &surface.spectrum),
            None => Ok(()),
        }
    }

    /// Returns the parameters of a random surface.
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

    /// Returns the seed of a random surface.
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
    /// Returns the diameter of the round hole \[m\]; `None` for a joint without a hole.
    pub fn hole_diameter(&self) -> Option<f64> {
        match self {
            Cells::Hole { diameter } => Some(*diameter),
            Cells::All | Cells::Elements { .. } => None,
        }
    }

    /// Returns the number of contact elements along x and y; zero for a joint without contact elements.
    pub fn element_counts(&self) -> [usize; 2] {
        match self {
            Cells::Elements { counts, .. } => *counts,
            Cells::All | Cells::Hole { .. } => [0; 2],
        }
    }
}

impl Surface {
    /// Returns the contact elements that match the cells of the joint; `None` if the cells do not follow contact
    /// elements.
    ///
    /// # Errors
    /// [`ModelUpdateError`] if the grid is coarser than the elements.
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

    /// Returns the grid with the cells that belong to the joint.
    ///
    /// # Errors
    /// The errors of [`Surface::contact_elements`].
    pub fn patch(&self) -> Result<Patch, ModelUpdateError> {
        Ok(match (self.contact_elements()?, &self.cells) {
            (Some(elements), _) => elements.patch().clone(),
            (None, Cells::Hole { diameter }) => Patch::with_hole(self.grid(), *diameter),
            (None, _) => Patch::full(self.grid()),
        })
    }
}
