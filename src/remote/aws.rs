//! What the tools of AWS have beside the environment: profiles in files.

use super::metadata::has_metadata;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Settings of a profile, by their names in the files.
type Profile = BTreeMap<String, String>;

/// The least bytes of the files that are read.
const LONGEST: u64 = 1 << 20;

/// Variables of the environment that name a source of credentials.
const SOURCES: [&str; 4] = [
    "AWS_ACCESS_KEY_ID",
    "AWS_WEB_IDENTITY_TOKEN_FILE",
    "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
    "AWS_CONTAINER_CREDENTIALS_FULL_URI",
];

/// A builder with the environment's settings, else those of the profile, else without a signature.
pub(crate) fn builder() -> AmazonS3Builder {
    let builder = AmazonS3Builder::from_env();
    let profile = profile();
    let named = SOURCES.iter().any(|name| set(name));
    let set_by = |builder: AmazonS3Builder, key: AmazonS3ConfigKey, name: &str| {
        let here = builder.get_config_value(&key).is_some();
        match profile.get(name) {
            Some(value) if !here => builder.with_config(key, value),
            _ => builder,
        }
    };
    let mut builder = set_by(builder, AmazonS3ConfigKey::Region, "region");
    builder = set_by(builder, AmazonS3ConfigKey::Endpoint, "endpoint_url");
    if named {
        return builder;
    }
    if profile.contains_key("aws_access_key_id") {
        builder = set_by(builder, AmazonS3ConfigKey::AccessKeyId, "aws_access_key_id");
        let secret = AmazonS3ConfigKey::SecretAccessKey;
        builder = set_by(builder, secret, "aws_secret_access_key");
        return set_by(builder, AmazonS3ConfigKey::Token, "aws_session_token");
    }
    if set("AWS_METADATA_ENDPOINT") || has_metadata() {
        return builder;
    }
    builder.with_skip_signature(true)
}

fn set(name: &str) -> bool {
    std::env::var_os(name).is_some_and(|value| !value.is_empty())
}

/// The profile of `AWS_PROFILE`, or the default one; empty without files.
fn profile() -> Profile {
    let name = std::env::var("AWS_PROFILE").unwrap_or_else(|_| "default".into());
    let file = |variable: &str, usual: &str| {
        let given = std::env::var_os(variable).map(PathBuf::from);
        let path = given.or_else(|| Some(std::env::home_dir()?.join(".aws").join(usual)))?;
        let about = path.metadata().ok()?;
        (about.len() <= LONGEST).then(|| std::fs::read_to_string(path).ok())?
    };
    let mut found = Profile::new();
    if let Some(text) = file("AWS_CONFIG_FILE", "config") {
        let section = match name.as_str() {
            "default" => "default".to_owned(),
            other => format!("profile {other}"),
        };
        found.extend(section_of(&text, &section));
    }
    if let Some(text) = file("AWS_SHARED_CREDENTIALS_FILE", "credentials") {
        found.extend(section_of(&text, &name));
    }
    found
}

/// The settings of one section: lines `name = value` after `[section]`.
fn section_of(text: &str, section: &str) -> Profile {
    let mut found = Profile::new();
    let mut inside = false;
    for line in text.lines() {
        let trimmed = line.trim();
        if let Some(title) = trimmed.strip_prefix('[').and_then(|t| t.strip_suffix(']')) {
            inside = title.trim() == section;
        } else if inside
            && !trimmed.starts_with(['#', ';'])
            && let Some((name, value)) = trimmed.split_once('=')
        {
            found.insert(name.trim().to_ascii_lowercase(), value.trim().to_owned());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_ends_with_the_next() {
        let text = "[default]\nregion=eu-west-1\n\n# other\n[profile big]\nregion = us-west-2\n\
                    aws_access_key_id = AB=\n;x=1\n[late]\nregion = x";
        let of = |name| section_of(text, name);
        assert_eq!(of("default")["region"], "eu-west-1");
        assert_eq!(of("profile big")["aws_access_key_id"], "AB=");
        assert_eq!(of("profile big").len(), 2);
        assert!(of("none").is_empty());
    }
}
