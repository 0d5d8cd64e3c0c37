//! Study of the paper: the scenes of the study, and the evaluation of the paper's claims on runs.

pub mod claims;

/// Name and text of a scene, as shipped in `pipelines/study`.
pub type ShippedScene = (&'static str, &'static str);

/// Base scene of all joints of the study. The file of the base scene is in the parent folder of the joints' scenes.
pub const BASE: ShippedScene = ("lap_joint", include_str!("../../pipelines/lap_joint.toml"));

/// Law of the contact elements of a study. The law selects the scene `joint` that the joints of the study are based on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// Law of the paper.
    Paper,
    /// Law of this program.
    Sliders,
}

impl Law {
    /// Returns the name of the folder of the scenes. The names of the runs begin with the name of the folder.
    pub fn word(self) -> &'static str {
        match self {
            Law::Paper => "paper",
            Law::Sliders => "sliders",
        }
    }

    /// Returns the text of `joint.toml`.
    pub fn joint(self) -> &'static str {
        match self {
            Law::Paper => include_str!("../../pipelines/study/joint.toml"),
            Law::Sliders => include_str!("../../pipelines/study/joint_sliders.toml"),
        }
    }
}

/// Scenes that the study computes for each contact law. The scenes vary the roughness, the plasticity, the updates, the
/// algorithm and the harmonics.
pub const JOINT_SCENES: [ShippedScene; 11] = [
    ("rq05", include_str!("../../pipelines/study/rq05.toml")),
    ("rq1", include_str!("../../pipelines/study/rq1.toml")),
    ("rq5", include_str!("../../pipelines/study/rq5.toml")),
    ("rq10", include_str!("../../pipelines/study/rq10.toml")),
    (
        "plastic",
        include_str!("../../pipelines/study/plastic.toml"),
    ),
    (
        "update05",
        include_str!("../../pipelines/study/update05.toml"),
    ),
    (
        "update10",
        include_str!("../../pipelines/study/update10.toml"),
    ),
    (
        "update20",
        include_str!("../../pipelines/study/update20.toml"),
    ),
    (
        "explicit",
        include_str!("../../pipelines/study/explicit.toml"),
    ),
    (
        "harmonics5",
        include_str!("../../pipelines/study/harmonics5.toml"),
    ),
    (
        "harmonics7",
        include_str!("../../pipelines/study/harmonics7.toml"),
    ),
];

/// Scenes that do not depend on the law: elements with individual stiffness, and spheres with and without a hardness
/// limit.
pub const LAW_INDEPENDENT_SCENES: [ShippedScene; 5] = [
    (
        "tangent",
        include_str!("../../pipelines/study/tangent.toml"),
    ),
    ("sphere", include_str!("../../pipelines/study/sphere.toml")),
    (
        "sphere600",
        include_str!("../../pipelines/study/sphere600.toml"),
    ),
    (
        "sphere500",
        include_str!("../../pipelines/study/sphere500.toml"),
    ),
    (
        "sphere450",
        include_str!("../../pipelines/study/sphere450.toml"),
    ),
];
