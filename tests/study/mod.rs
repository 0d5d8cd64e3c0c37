//! The paper's study.

mod claims;
mod scenes;
