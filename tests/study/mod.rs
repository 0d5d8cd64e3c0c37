//! Tests of the paper's study.

mod claims;
mod scenes;
