//! Untrusted Parquet files. fretwear checks the sizes that a file declares before it decompresses any part of the file.

use std::any::Any;
use std::panic::{self, AssertUnwindSafe};

use parquet::basic::CompressionCodec;
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;

/// Supported compressions: Zstandard, which fretwear uses, and the default compressions of other programs.
const CODECS: [CompressionCodec; 6] = [
    CompressionCodec::UNCOMPRESSED,
    CompressionCodec::SNAPPY,
    CompressionCodec::GZIP,
    CompressionCodec::LZ4,
    CompressionCodec::LZ4_RAW,
    CompressionCodec::ZSTD,
];

/// Names of the supported compressions.
pub fn codecs() -> String {
    CODECS.map(|codec| codec.to_string()).join(", ")
}

/// Returns the first unsupported compression in a file.
pub fn unread_codec(metadata: &ParquetMetaData) -> Option<String> {
    metadata
        .row_groups()
        .iter()
        .flat_map(|group| group.columns())
        .map(|column| column.compression_codec())
        .find(|codec| !CODECS.contains(codec))
        .map(|codec| codec.to_string())
}

/// Returns the number of rows that a file declares.
pub fn declared_rows(metadata: &ParquetMetaData) -> i64 {
    metadata
        .row_groups()
        .iter()
        .map(|group| group.num_rows())
        .fold(0, i64::saturating_add)
}

/// Runs `decode` and converts a panic of `decode` into an error. The Parquet library panics on some damaged bytes.
///
/// # Errors
/// [`ParquetError::General`] with the text of the panic.
pub fn catching_panics<T>(decode: impl FnOnce() -> T) -> Result<T, ParquetError> {
    // After a panic, no state of `decode` is used.
    panic::catch_unwind(AssertUnwindSafe(decode))
        .map_err(|reason| ParquetError::General(format!("damaged: {}", words(&*reason))))
}

fn words(reason: &(dyn Any + Send)) -> &str {
    let text = reason.downcast_ref::<String>().map(String::as_str);
    text.or(reason.downcast_ref::<&str>().copied())
        .unwrap_or("it cannot be decoded")
}
