//! Fretting wear of rough joints over millions of vibration cycles.
//!
//! The numerics ([`contact`], [`dynamics`], [`model_update`], [`surface`], [`structure`], [`wear`], [`mod@reference`]) are pure: they
//! know no file, no scene and no terminal.
//! [`scene`] is what the user writes, [`tables`] and [`store`] are what a run leaves on disk, and [`stages`] joins them.

pub mod contact;
pub mod doctor;
pub mod dynamics;
pub mod fft;
pub mod grid;
pub mod linalg;
pub mod model_update;
pub mod reference;
pub mod report;
pub mod scene;
pub mod stages;
pub mod store;
pub mod structure;
pub mod surface;
pub mod tables;
pub mod units;
pub mod validate;
pub mod wear;
