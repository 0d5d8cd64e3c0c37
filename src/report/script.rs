//! The script of a page, which shows the values of a drawing where somebody points.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

/// The page is complete without it.
pub const SCRIPT: &str = include_str!("page.js");

/// What a browser is to refuse: all but what is in the page, and of scripts all but this one.
pub fn policy() -> String {
    let hash = STANDARD.encode(Sha256::digest(SCRIPT));
    format!(
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{hash}'; base-uri 'none'; form-action 'none'"
    )
}
