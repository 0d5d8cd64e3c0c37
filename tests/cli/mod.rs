//! Tests of the command line: exit codes, messages and stdout.

mod backbone;
mod check;
mod codes;
mod completions;
mod export;
mod export_contact;
mod export_vtu;
mod inspect;
mod kept;
mod layouts;
mod new;
mod outputs;
mod pasted;
#[cfg(feature = "polars")]
mod reproduce;
mod resonances;
mod sets;
mod status;
mod stranger;
mod terminal;
mod trade;
mod when;
mod written;
