//! Reports on finished and running runs.
//!
//! Modules that read the tables of many iterations at once need the feature `polars`.

#[cfg(feature = "polars")]
mod backbone;
#[cfg(feature = "polars")]
pub mod campaign;
#[cfg(feature = "polars")]
mod compare;
#[cfg(feature = "polars")]
mod differences;
#[cfg(feature = "polars")]
mod error;
mod error_bars;
mod figure_text;
#[cfg(feature = "polars")]
mod figures;
#[cfg(feature = "polars")]
mod headline;
pub mod output;
#[cfg(feature = "polars")]
mod page;
#[cfg(feature = "polars")]
mod plot;
pub mod quantity;
#[cfg(feature = "polars")]
mod results;
#[cfg(feature = "polars")]
mod run_tables;
#[cfg(feature = "polars")]
mod scan;
#[cfg(feature = "polars")]
mod script;
#[cfg(feature = "polars")]
mod sections;
#[cfg(feature = "polars")]
mod skipped_folders;
pub(crate) mod table;
#[cfg(feature = "polars")]
mod template;
pub(crate) mod text;
pub mod trade;
#[cfg(feature = "polars")]
mod warnings;

#[cfg(feature = "polars")]
pub use backbone::backbone_svg;
#[cfg(feature = "polars")]
pub use compare::{Cell, ComparedRun, Comparison, Rows, compare};
#[cfg(feature = "polars")]
pub use error::ReportError;
pub use error_bars::{ERROR_BARS, error_bar_of, percent};
pub use figure_text::{CharacteristicSizes, figure_with_bar, upper_bound};
#[cfg(feature = "polars")]
pub use figures::Figure;
#[cfg(feature = "polars")]
pub use page::Report;
#[cfg(feature = "polars")]
pub use plot::Drawing;
#[cfg(feature = "polars")]
pub use run_tables::{RunTables, numeric_column, scan_runs, text_column};
#[cfg(feature = "polars")]
pub use scan::{RUN, RUN_INDEX, WEAR_ITERATION};
#[cfg(feature = "polars")]
pub use skipped_folders::SkippedFolder;
#[cfg(feature = "polars")]
pub use template::Section;
pub use text::{continue_command, escape_controls, is_control, one_line_name, shell_word};
