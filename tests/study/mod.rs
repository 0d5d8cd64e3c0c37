//! The paper's study.

mod claims;
