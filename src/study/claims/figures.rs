//! Figures of a report and the corresponding figures of the paper.

/// Ids of figures of the report, each with the figures of the paper to compare it with.
pub const FIGURES: [(&str, &str); 14] = [
    ("contact-mesh", "figure 6b"),
    ("surface", "figure 6a"),
    ("resonance-shape", "figure 5"),
    ("forced-response", "figures 7, 16 and 18a"),
    ("joint-cycle", "figure 8"),
    ("wear-map", "figure 9"),
    ("pressure", "figures 19 and 20"),
    ("section", "figures 10 and 12"),
    ("roughness", "figure 11"),
    ("contact-area", "figures 13 and 21a"),
    ("stiffness", "figures 14, 15b and 21b"),
    ("wear-rate", "figures 15a and 18b"),
    ("responses-over-wear", "figure 17a"),
    ("dissipation", "figures 17b and 22"),
];
