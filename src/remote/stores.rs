//! The store that has a file, with the credentials that the store's own tools would use.

use super::agent::{Connector, Counts, Temper};
use super::aws;
use super::location::Location;
use super::metadata::has_metadata;
use object_store::aws::{AmazonS3, AmazonS3ConfigKey};
use object_store::azure::{AzureConfigKey, MicrosoftAzure, MicrosoftAzureBuilder};
use object_store::gcp::{GoogleCloudStorage, GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::http::{HttpBuilder, HttpStore};
use object_store::path::Path;
use object_store::{BackoffConfig, ObjectStore, Result, RetryConfig};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Outages of this length are survived while points are read.
const PATIENCE: Duration = Duration::from_secs(170);

/// The same before anything is read: a wrong name or a closed door shall be told soon.
const IMPATIENCE: Duration = Duration::from_secs(15);

/// Waits between requests that fail grow up to this.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// Where Google's store is.
const GOOGLE: &str = "https://storage.googleapis.com";

/// How long a request is repeated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Patience {
    /// For seconds: nothing is lost yet.
    Short,
    /// For minutes.
    Long,
}

impl Patience {
    pub(crate) fn time(self) -> Duration {
        match self {
            Self::Short => IMPATIENCE,
            Self::Long => PATIENCE,
        }
    }

    fn retries(self) -> RetryConfig {
        RetryConfig {
            backoff: BackoffConfig {
                init_backoff: Duration::from_millis(200),
                max_backoff: LONGEST_PAUSE,
                base: 2.0,
            },
            max_retries: usize::MAX,
            retry_timeout: self.time(),
        }
    }
}

/// A store, and the path of the file in it.
pub(crate) type Place = (Arc<dyn ObjectStore>, Path);

/// The place of a location; requests are counted in `counts`.
pub(crate) fn place(
    location: &Location,
    patience: Patience,
    counts: &Arc<Counts>,
) -> Result<Place> {
    Door::new(patience, counts).place(location)
}

/// The place of a file that is opened: requests end soon until the client is told to be calm, by which time the file is
/// known to be there.
pub(crate) fn place_of_new(
    location: &Location,
    counts: &Arc<Counts>,
) -> Result<(Place, Arc<Temper>)> {
    let temper = Arc::new(Temper::hasty(IMPATIENCE));
    let door = Door {
        patience: Patience::Long,
        temper: temper.clone(),
        counts,
    };
    Ok((door.place(location)?, temper))
}

impl<'a> Door<'a> {
    pub(crate) fn new(patience: Patience, counts: &'a Arc<Counts>) -> Self {
        Self {
            patience,
            temper: Arc::new(Temper::new(patience == Patience::Long)),
            counts,
        }
    }

    fn place(&self, location: &Location) -> Result<Place> {
        let store: Arc<dyn ObjectStore> = match location.url.scheme() {
            "http" | "https" => Arc::new(self.web(location)?),
            "s3" | "s3a" => Arc::new(self.amazon(location)?),
            "gs" => Arc::new(self.google(location)?.0),
            _ => Arc::new(self.azure(location)?),
        };
        Ok((store, location.path()?))
    }
}

/// What all stores are made with.
pub(crate) struct Door<'a> {
    patience: Patience,
    temper: Arc<Temper>,
    counts: &'a Arc<Counts>,
}

/// The end of the builders of all stores, which have no type in common: the client, whose addresses start with `$address`.
macro_rules! built {
    ($door:expr, $location:expr, $builder:expr, $address:expr) => {
        $builder
            .with_http_connector($door.client($address, false))
            .with_retry($door.patience.retries())
            .with_url($location.url.as_str())
            .build()
    };
}

impl Door<'_> {
    /// The client of a store whose address starts with `address`.
    pub(crate) fn client(&self, address: &str, follows: bool) -> Connector {
        let secure = !address.starts_with("http://");
        Connector::new(secure, follows, self.temper.clone(), self.counts.clone())
    }

    fn web(&self, location: &Location) -> Result<HttpStore> {
        let mut base = location.url.clone();
        base.set_path("");
        HttpBuilder::new()
            .with_http_connector(self.client(base.as_str(), true))
            .with_retry(self.patience.retries())
            .with_url(base.to_string())
            .build()
    }

    pub(crate) fn amazon(&self, location: &Location) -> Result<AmazonS3> {
        let mut builder = aws::builder();
        let own = [AmazonS3ConfigKey::S3Endpoint, AmazonS3ConfigKey::Endpoint]
            .iter()
            .find_map(|key| builder.get_config_value(key));
        let region = builder.get_config_value(&AmazonS3ConfigKey::Region);
        if own.is_none() && region.is_none() {
            let bucket = location.url.host_str().unwrap_or_default();
            let region = self.region(bucket).unwrap_or_else(|| "us-east-1".into());
            builder = builder.with_region(region);
        }
        built!(
            self,
            location,
            builder,
            own.as_deref().unwrap_or("https://")
        )
    }

    /// The region of a bucket, which is asked for once.
    fn region(&self, bucket: &str) -> Option<String> {
        static KNOWN: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());
        let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(region) = known().get(bucket) {
            return Some(region.clone());
        }
        let region = self.asked_region(bucket)?;
        known().insert(bucket.to_owned(), region.clone());
        Some(region)
    }

    /// The region of a bucket, which Amazon tells anybody.
    fn asked_region(&self, bucket: &str) -> Option<String> {
        use object_store::client::{HttpConnector, HttpRequest, HttpRequestBody};
        let address = format!("https://s3.amazonaws.com/{bucket}");
        let request = http::Request::head(&address).body(HttpRequestBody::empty());
        let request: HttpRequest = request.ok()?;
        let client = self.client(&address, false).connect(&Default::default());
        let answer = super::wait::wait(client.ok()?.execute(request))
            .ok()?
            .ok()?;
        let region = answer.headers().get("x-amz-bucket-region")?;
        Some(region.to_str().ok()?.to_owned())
    }

    /// Google's store, and its address.
    pub(crate) fn google(&self, location: &Location) -> Result<(GoogleCloudStorage, String)> {
        let mut builder = GoogleCloudStorageBuilder::from_env();
        let mut base = builder.get_config_value(&GoogleConfigKey::BaseUrl);
        if let (None, Ok(emulator)) = (&base, std::env::var("STORAGE_EMULATOR_HOST")) {
            let emulator = match emulator.contains("://") {
                true => emulator,
                false => format!("http://{emulator}"),
            };
            builder = builder
                .with_config(GoogleConfigKey::BaseUrl, &emulator)
                .with_skip_signature(true);
            base = Some(emulator);
        }
        let sources = [
            GoogleConfigKey::ServiceAccount,
            GoogleConfigKey::ServiceAccountKey,
            GoogleConfigKey::ApplicationCredentials,
            GoogleConfigKey::BearerToken,
        ];
        let named = sources
            .iter()
            .any(|key| builder.get_config_value(key).is_some());
        let usual = std::env::home_dir()
            .map(|home| home.join(".config/gcloud/application_default_credentials.json"));
        if !named && !usual.is_some_and(|file| file.is_file()) && !has_metadata() {
            builder = builder.with_skip_signature(true);
        }
        let base = base.unwrap_or_else(|| GOOGLE.to_owned());
        Ok((built!(self, location, builder, &base)?, base))
    }

    pub(crate) fn azure(&self, location: &Location) -> Result<MicrosoftAzure> {
        let mut builder = MicrosoftAzureBuilder::from_env();
        let value = |key| builder.get_config_value(&key);
        let emulator = value(AzureConfigKey::UseEmulator).is_some_and(|v| v == "true");
        let address = match (value(AzureConfigKey::Endpoint), emulator) {
            (Some(own), _) => own,
            (None, true) => "http://".to_owned(),
            (None, false) => "https://".to_owned(),
        };
        let sources = [
            AzureConfigKey::AccessKey,
            AzureConfigKey::ClientSecret,
            AzureConfigKey::SasKey,
            AzureConfigKey::Token,
            AzureConfigKey::FederatedTokenFile,
            AzureConfigKey::MsiEndpoint,
            AzureConfigKey::UseAzureCli,
        ];
        let named = sources.into_iter().any(|key| value(key).is_some());
        if !named && !emulator && !has_metadata() {
            builder = builder.with_skip_signature(true);
        }
        built!(self, location, builder, &address)
    }
}
