//! The store that has a file, with the credentials that the store's own tools would use.

use super::agent::{Connector, Counts};
use super::aws;
use super::location::Location;
use object_store::aws::AmazonS3ConfigKey;
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::http::HttpBuilder;
use object_store::path::Path;
use object_store::{BackoffConfig, Error, ObjectStore, Result, RetryConfig};
use std::sync::Arc;
use std::time::Duration;

/// Outages of this length are survived while points are read.
const PATIENCE: Duration = Duration::from_secs(170);

/// The same before anything is read: a wrong name or a closed door shall be told soon.
const IMPATIENCE: Duration = Duration::from_secs(15);

/// Waits between requests that fail grow up to this.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

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
    let url = &location.url;
    let path = Path::from_url_path(url.path().trim_start_matches('/'))
        .map_err(|source| Error::InvalidPath { source })?;
    let door = Door { patience, counts };
    let store = match url.scheme() {
        "http" | "https" => door.web(location)?,
        "s3" | "s3a" => door.amazon(location)?,
        "gs" => door.google(location)?,
        _ => door.azure(location)?,
    };
    Ok((store, path))
}

/// What all stores are made with.
struct Door<'a> {
    patience: Patience,
    counts: &'a Arc<Counts>,
}

impl Door<'_> {
    /// The client of a store whose address starts with `address`.
    fn client(&self, address: &str, follows: bool) -> Connector {
        let secure = !address.starts_with("http://");
        let patient = self.patience == Patience::Long;
        Connector::new(secure, follows, patient, self.counts.clone())
    }

    fn web(&self, location: &Location) -> Result<Arc<dyn ObjectStore>> {
        let mut base = location.url.clone();
        base.set_path("");
        let store = HttpBuilder::new()
            .with_http_connector(self.client(base.as_str(), true))
            .with_retry(self.patience.retries())
            .with_url(base.to_string())
            .build()?;
        Ok(Arc::new(store))
    }

    fn amazon(&self, location: &Location) -> Result<Arc<dyn ObjectStore>> {
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
        let store = builder
            .with_http_connector(self.client(own.as_deref().unwrap_or("https://"), false))
            .with_retry(self.patience.retries())
            .with_url(location.url.as_str())
            .build()?;
        Ok(Arc::new(store))
    }

    /// The region of a bucket, which Amazon tells anybody.
    fn region(&self, bucket: &str) -> Option<String> {
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

    fn google(&self, location: &Location) -> Result<Arc<dyn ObjectStore>> {
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
        if !named && !usual.is_some_and(|file| file.is_file()) && !aws::has_metadata() {
            builder = builder.with_skip_signature(true);
        }
        let store = builder
            .with_http_connector(self.client(base.as_deref().unwrap_or("https://"), false))
            .with_retry(self.patience.retries())
            .with_url(location.url.as_str())
            .build()?;
        Ok(Arc::new(store))
    }

    fn azure(&self, location: &Location) -> Result<Arc<dyn ObjectStore>> {
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
        if !named && !emulator && !aws::has_metadata() {
            builder = builder.with_skip_signature(true);
        }
        let store = builder
            .with_http_connector(self.client(&address, false))
            .with_retry(self.patience.retries())
            .with_url(location.url.as_str())
            .build()?;
        Ok(Arc::new(store))
    }
}
