//! The paper's study: its scenes, and its claims held against the tables of runs.

pub mod claims;

/// The scenes of the paper's study, as shipped: roughness, plasticity, updates. The first is the base of the others.
pub const SCENES: [(&str, &str); 8] = [
    ("lap_joint", include_str!("../../pipelines/lap_joint.toml")),
    (
        "lap_joint_rq05",
        include_str!("../../pipelines/lap_joint_rq05.toml"),
    ),
    (
        "lap_joint_rq1",
        include_str!("../../pipelines/lap_joint_rq1.toml"),
    ),
    (
        "lap_joint_rq10",
        include_str!("../../pipelines/lap_joint_rq10.toml"),
    ),
    (
        "lap_joint_plastic",
        include_str!("../../pipelines/lap_joint_plastic.toml"),
    ),
    (
        "lap_joint_update05",
        include_str!("../../pipelines/lap_joint_update05.toml"),
    ),
    (
        "lap_joint_update20",
        include_str!("../../pipelines/lap_joint_update20.toml"),
    ),
    (
        "lap_joint_no_update",
        include_str!("../../pipelines/lap_joint_no_update.toml"),
    ),
];
