//! Runs and campaigns in object storage: published whole, fetched whole.
//!
//! ```text
//! PREFIX/
//!   published.json                    what is published: every file with its length and hash; what it does not name is not there
//!   collected/shard-00000.parquet     of a campaign, under their own names: what is never changed once it is written
//!   ended/000017.parquet
//!   iterations/wear_iteration=3/...   of a run
//!   content/HASH                      all other files, under the hash of their content
//!   conditions                        by which the storage has shown that it heeds conditions
//! ```
//!
//! Every object is written under the condition that there is none of its name, so that nothing is ever overwritten. `published.json` alone
//! is replaced, after all that it names is there, and under the condition that it is still the one that was read. A publication that ends
//! at any instant leaves what was published before it; the next one finds what has been uploaded and goes on. Of two at once the
//! later adds to what the earlier has published.
//!
//! What comes from a bucket is untrusted: names of files come from a closed list of forms, lengths are looked at before anything is read,
//! and contents are held against their hashes. Whoever may write `published.json` may publish another run in its place all the same: a hash
//! is no signature.
//!
//! Objects are reached through [`Objects`], so that tests can make any call fail; `s3` (with the feature `object_store`) is the only part
//! that knows a network.

mod error;
mod fetch;
mod files;
mod manifest;
mod objects;
mod publish;
#[cfg(feature = "object_store")]
mod s3;

pub use error::PublishError;
pub use fetch::{Fetched, fetch};
pub use files::Kind;
pub use objects::{Found, ObjectError, Objects, Put, Version};
pub use publish::{Published, publish};
#[cfg(feature = "object_store")]
pub use s3::Bucket;
