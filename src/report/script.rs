//! Script of a page, which shows the values of a drawing under the pointer.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

/// Source of the script. The page shows all results without the script.
pub const SCRIPT: &str = include_str!("page.js");

/// Content security policy of a page. The policy allows only the content of the page itself and [`SCRIPT`].
pub fn policy() -> String {
    let hash = STANDARD.encode(Sha256::digest(SCRIPT));
    format!(
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{hash}'; base-uri 'none'; form-action 'none'"
    )
}
