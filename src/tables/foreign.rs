//! Parquet files whose bytes nobody vouches for: what they announce is looked at before anything of them is unpacked.

use std::any::Any;
use std::panic::{self, AssertUnwindSafe};

use parquet::basic::CompressionCodec;
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;

/// The compressions that the format library is built with: our own, and those that other programs write by default.
const CODECS: [CompressionCodec; 6] = [
    CompressionCodec::UNCOMPRESSED,
    CompressionCodec::SNAPPY,
    CompressionCodec::GZIP,
    CompressionCodec::LZ4,
    CompressionCodec::LZ4_RAW,
    CompressionCodec::ZSTD,
];

/// The names of the compressions that are read.
pub fn codecs() -> String {
    CODECS.map(|codec| codec.to_string()).join(", ")
}

/// The first compression of a file that is not read.
pub fn unread_codec(metadata: &ParquetMetaData) -> Option<String> {
    metadata
        .row_groups()
        .iter()
        .flat_map(|group| group.columns())
        .map(|column| column.compression_codec())
        .find(|codec| !CODECS.contains(codec))
        .map(|codec| codec.to_string())
}

/// The rows that a file announces.
pub fn declared_rows(metadata: &ParquetMetaData) -> i64 {
    metadata
        .row_groups()
        .iter()
        .map(|group| group.num_rows())
        .fold(0, i64::saturating_add)
}

/// What `decode` makes of bytes. The format library asserts some of what damaged bytes break; that is an error of the bytes.
///
/// # Errors
/// [`ParquetError::General`] with the words of the assertion.
pub fn decoded<T>(decode: impl FnOnce() -> T) -> Result<T, ParquetError> {
    // Nothing that `decode` leaves half done is looked at.
    panic::catch_unwind(AssertUnwindSafe(decode))
        .map_err(|reason| ParquetError::General(format!("damaged: {}", words(&*reason))))
}

fn words(reason: &(dyn Any + Send)) -> &str {
    let text = reason.downcast_ref::<String>().map(String::as_str);
    text.or(reason.downcast_ref::<&str>().copied())
        .unwrap_or("it cannot be decoded")
}
