//! Storage that speaks the protocol of Amazon S3.

use std::collections::BTreeSet;
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use futures_util::TryStreamExt;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::path::Path;
use object_store::{
    ClientOptions, Error, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload,
    RetryConfig, UpdateVersion,
};
use tokio::runtime::{Builder, Runtime};

use super::error::PublishError;
use super::objects::{Found, ObjectError, Objects, Put, Version};

/// Objects of a prefix at most; ten times what one publication may have.
const MOST_OBJECTS: usize = 4_000_000;
/// A server that does not answer is none.
const CONNECT: Duration = Duration::from_secs(10);
/// A request is tried again for so long.
const RETRY: Duration = Duration::from_secs(60);
const RETRIES: usize = 5;

/// What goes before the name of a bucket.
const SCHEME: &str = "s3://";

/// The objects below a prefix of a bucket.
pub struct Bucket {
    place: String,
    prefix: Path,
    store: Arc<dyn ObjectStore>,
    runtime: Runtime,
}

impl Bucket {
    /// That of `s3://BUCKET/PREFIX`, with what the usual variables say (`AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`,
    /// `AWS_ENDPOINT_URL` and others). Nothing is asked of it yet.
    ///
    /// # Errors
    /// [`PublishError::NoPlace`], [`PublishError::Objects`].
    pub fn at(place: &str) -> Result<Bucket, PublishError> {
        let no_place = || PublishError::NoPlace {
            place: place.to_owned(),
        };
        let rest = place.strip_prefix(SCHEME).ok_or_else(no_place)?;
        let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        let is_plain = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
        let is_bucket = !bucket.is_empty() && bucket.chars().all(is_plain);
        // The library would pass over a slash at the beginning.
        if !is_bucket || prefix.starts_with('/') {
            return Err(no_place());
        }
        let prefix = Path::parse(prefix.trim_end_matches('/')).map_err(|_| no_place())?;
        let mut options = ClientOptions::new().with_connect_timeout(CONNECT);
        let mut builder = AmazonS3Builder::from_env().with_bucket_name(bucket);
        let endpoint = builder.get_config_value(&AmazonS3ConfigKey::Endpoint);
        // Who names one without encryption wants it so.
        if endpoint.is_some_and(|endpoint| endpoint.starts_with("http://")) {
            options = options.with_allow_http(true);
        }
        let retry = RetryConfig {
            max_retries: RETRIES,
            retry_timeout: RETRY,
            ..RetryConfig::default()
        };
        builder = builder.with_client_options(options).with_retry(retry);
        let place = place.trim_end_matches('/');
        let failed = |reason: String| ObjectError {
            action: "reach",
            name: place.to_owned(),
            reason,
        };
        let store = builder.build().map_err(|error| failed(reason(&error)))?;
        Bucket::over(Arc::new(store), place, prefix).map_err(PublishError::from)
    }

    /// That of another store, as of one in memory.
    ///
    /// # Errors
    /// Those of the system, which cannot start a thread.
    pub fn over(
        store: Arc<dyn ObjectStore>,
        place: &str,
        prefix: Path,
    ) -> Result<Bucket, ObjectError> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build();
        let runtime = runtime.map_err(|error| ObjectError {
            action: "reach",
            name: place.to_owned(),
            reason: error.to_string(),
        })?;
        Ok(Bucket {
            place: place.to_owned(),
            prefix,
            store,
            runtime,
        })
    }

    fn path(&self, name: &str) -> Path {
        name.split('/')
            .fold(self.prefix.clone(), |path, part| path.join(part))
    }

    fn wait<T>(&self, future: impl Future<Output = T>) -> T {
        self.runtime.block_on(future)
    }

    fn failed(&self, action: &'static str, name: &str, error: &Error) -> ObjectError {
        let name = match name {
            "" => self.place.clone(),
            name => format!("{}/{name}", self.place),
        };
        ObjectError {
            action,
            name,
            reason: reason(error),
        }
    }

    fn put(&self, name: &str, bytes: Vec<u8>, mode: PutMode) -> Result<Put, ObjectError> {
        let options = PutOptions::from(mode);
        let path = self.path(name);
        let put = self.store.put_opts(&path, PutPayload::from(bytes), options);
        match self.wait(put) {
            Ok(_) => Ok(Put::Done),
            Err(Error::AlreadyExists { .. } | Error::Precondition { .. }) => Ok(Put::Refused),
            Err(error) => Err(self.failed("write", name, &error)),
        }
    }
}

impl Objects for Bucket {
    fn place(&self) -> String {
        self.place.clone()
    }

    fn list(&self) -> Result<BTreeSet<String>, ObjectError> {
        let failed = |error: Error| self.failed("list", "", &error);
        let prefix = Some(&self.prefix).filter(|prefix| !prefix.as_ref().is_empty());
        self.wait(async {
            let mut found = BTreeSet::new();
            let mut objects = self.store.list(prefix);
            while let Some(object) = objects.try_next().await.map_err(failed)? {
                if let Some(parts) = object.location.prefix_match(&self.prefix) {
                    let parts: Vec<String> = parts.map(|part| part.as_ref().to_owned()).collect();
                    found.insert(parts.join("/"));
                }
                if found.len() > MOST_OBJECTS {
                    return Err(ObjectError {
                        action: "list",
                        name: self.place.clone(),
                        reason: format!(
                            "it has more than {MOST_OBJECTS} objects; give another prefix"
                        ),
                    });
                }
            }
            Ok(found)
        })
    }

    fn read(&self, name: &str, most: u64) -> Result<Found, ObjectError> {
        let path = self.path(name);
        let failed = |error: Error| self.failed("read", name, &error);
        self.wait(async {
            let object = match self.store.get(&path).await {
                Ok(object) => object,
                Err(Error::NotFound { .. }) => return Ok(Found::Nothing),
                Err(error) => return Err(failed(error)),
            };
            if object.meta.size > most {
                return Ok(Found::Longer(object.meta.size));
            }
            let version = Version(object.meta.e_tag.clone().unwrap_or_default());
            let mut bytes = Vec::with_capacity(object.meta.size as usize);
            let mut parts = object.into_stream();
            while let Some(part) = parts.try_next().await.map_err(failed)? {
                bytes.extend_from_slice(&part);
                // What a server says of its lengths is not relied on.
                if bytes.len() as u64 > most {
                    return Ok(Found::Longer(bytes.len() as u64));
                }
            }
            Ok(Found::Object(bytes, version))
        })
    }

    fn create(&self, name: &str, bytes: Vec<u8>) -> Result<Put, ObjectError> {
        self.put(name, bytes, PutMode::Create)
    }

    fn replace(&self, name: &str, bytes: Vec<u8>, version: &Version) -> Result<Put, ObjectError> {
        let version = UpdateVersion {
            e_tag: Some(version.0.clone()),
            version: None,
        };
        self.put(name, bytes, PutMode::Update(version))
    }
}

/// What a library says, and what may help.
fn reason(error: &Error) -> String {
    // The outermost says what was asked, which stands before it already; what went wrong is at the end.
    let mut causes: Vec<String> = Vec::new();
    let mut cause: Option<&dyn std::error::Error> = Some(error);
    while let Some(error) = cause {
        causes.push(error.to_string());
        cause = error.source();
    }
    let said = causes.first().cloned().unwrap_or_default();
    // Of an answer in XML the code is what counts, and that is looked for below.
    let said = said.split("<?xml").next().unwrap_or_default().trim();
    let has = |word: &str| causes.iter().any(|cause| cause.contains(word));
    let advice = if has("NoSuchBucket") {
        "there is no such bucket at this endpoint: make it, or see AWS_ENDPOINT_URL and AWS_REGION"
    } else if has("InvalidAccessKeyId") || has("SignatureDoesNotMatch") || has("InvalidToken") {
        "the storage does not know these credentials: see AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN"
    } else if has("169.254.") {
        "no credentials were found: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY (files of profiles are not read)"
    } else if matches!(error, Error::PermissionDenied { .. }) || has("AccessDenied") {
        "these credentials may not do that: listing, reading and writing below the prefix are needed (s3:ListBucket, s3:GetObject, s3:PutObject)"
    } else if matches!(error, Error::Unauthenticated { .. }) {
        "see AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN"
    } else if has("PermanentRedirect") || has("AuthorizationHeaderMalformed") {
        "the bucket is in another region: set AWS_REGION"
    } else if has("onnect") || has("dns") || has("timed out") {
        "the endpoint does not answer: see AWS_ENDPOINT_URL, or AWS_REGION where there is none"
    } else {
        let code = causes.iter().find_map(|cause| {
            let (_, rest) = cause.split_once("<Code>")?;
            rest.split_once("</Code>").map(|(code, _)| code.to_owned())
        });
        return match code {
            Some(code) => format!("{code} ({said})"),
            None => said.to_owned(),
        };
    };
    format!("{advice} ({said})")
}
