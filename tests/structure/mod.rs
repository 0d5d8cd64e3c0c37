//! Finite elements, modes and reduction against closed forms, an independent program and direct solves.

mod beam;
mod element;
mod matrices;
mod reduction;
mod resonator;
