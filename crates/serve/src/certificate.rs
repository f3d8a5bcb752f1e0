//! The certificate of a server that other machines reach, and its key: from files, or made here.

use super::host::Host;
use ring::digest::{SHA256, digest};
use rustls::client::verify_server_name;
use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::server::ParsedCertificate;
use rustls::{CertificateError, Error, ServerConfig};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use teachtree_base::error::InputError;

/// The largest file of a certificate or a key, bytes.
const MAX_FILE: u64 = 1 << 20;
const DAY: Duration = Duration::from_secs(24 * 60 * 60);
/// How long a certificate that is made here is good for: no longer than every browser takes (825 days), nor only from now on, since clocks differ.
const BEFORE: Duration = DAY;
const AFTER: Duration = Duration::from_secs(800 * 24 * 60 * 60);

/// A certificate with its key, and what serves by it.
pub struct Certificate {
    config: Arc<ServerConfig>,
    fingerprint: String,
}

impl Certificate {
    /// Makes a self-signed certificate and keeps it in memory.
    ///
    /// # Errors
    /// When the system gives no random numbers.
    pub fn make(host: &Host) -> Result<Self, InputError> {
        Self::of(&pem(host)?, host)
    }

    /// Makes a self-signed certificate and writes it into a new file, with its key, that only the user may read.
    ///
    /// # Errors
    /// When the file is there already or cannot be written.
    pub fn make_file(file: &Path, host: &Host) -> Result<Self, InputError> {
        let pem = pem(host)?;
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let write = || {
            // On Unix such files are the user's alone.
            let mut new = tempfile::NamedTempFile::new_in(folder)?;
            new.write_all(pem.as_bytes())?;
            new.as_file().sync_all()?;
            new.persist_noclobber(file).map_err(|error| error.error)
        };
        write().map_err(|error| {
            // Without the name of the temporary file.
            let why = match error.kind() {
                ErrorKind::NotFound => "there is no such folder".to_string(),
                kind => kind.to_string(),
            };
            InputError::new(shown(file), format!("cannot be written: {why}"))
        })?;
        Self::of(&pem, host)
    }

    /// Reads a certificate, with those that signed it after it, and its key, which may be in the same file.
    ///
    /// # Errors
    /// When a file cannot be read or lacks them, when they do not belong together, or when the certificate is for other hosts.
    pub fn open(file: &Path, key: &Path, host: &Host) -> Result<Self, InputError> {
        let certificates: Vec<_> = sections(file, "a certificate")?;
        let keys = sections(key, "a private key, not encrypted,")?;
        Self::new(certificates, keys, host).map_err(|message| InputError::new(shown(file), message))
    }

    fn of(pem: &str, host: &Host) -> Result<Self, InputError> {
        let read = || {
            let certificates = CertificateDer::pem_slice_iter(pem.as_bytes()).collect::<Result<_, _>>().ok()?;
            Some((certificates, PrivateKeyDer::pem_slice_iter(pem.as_bytes()).collect::<Result<_, _>>().ok()?))
        };
        let (certificates, keys) = read().unwrap_or_default();
        Self::new(certificates, keys, host).map_err(|message| InputError::new("the certificate", message))
    }

    fn new(
        certificates: Vec<CertificateDer<'static>>,
        keys: Vec<PrivateKeyDer<'static>>,
        host: &Host,
    ) -> Result<Self, String> {
        let (Some(first), Some(key)) = (certificates.first(), keys.into_iter().next()) else {
            return Err("expected a certificate and its key".into());
        };
        let unusable = |error: Error| match error {
            Error::InvalidCertificate(why) => format!("the certificate cannot be used: {why}"),
            Error::InconsistentKeys(_) => "the key is not the one of this certificate".to_string(),
            error => format!("the certificate cannot be used: {error}"),
        };
        let name = ServerName::try_from(host.to_string()).map_err(|_| format!("`{host}` is not a name of a host"))?;
        let parsed = ParsedCertificate::try_from(first).map_err(unusable)?;
        verify_server_name(&parsed, &name).map_err(|error| match error {
            Error::InvalidCertificate(
                CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. },
            ) => format!("the certificate is not for the host `{host}`"),
            error => unusable(error),
        })?;
        let bytes = digest(&SHA256, first);
        let digits: Vec<String> = bytes.as_ref().iter().map(|byte| format!("{byte:02X}")).collect();
        let config = ServerConfig::builder_with_provider(Arc::new(default_provider()))
            .with_safe_default_protocol_versions()
            .and_then(|config| config.with_no_client_auth().with_single_cert(certificates, key))
            .map_err(unusable)?;
        Ok(Self { config: Arc::new(config), fingerprint: digits.join(":") })
    }

    /// How a server encrypts by it.
    pub fn config(&self) -> &Arc<ServerConfig> {
        &self.config
    }

    /// The SHA-256 of the certificate, by which browsers show it: `4F:0A:…`.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }
}

fn shown(file: &Path) -> String {
    file.display().to_string()
}

/// The sections of a kind in a file, at least one.
fn sections<T: PemObject>(file: &Path, what: &str) -> Result<Vec<T>, InputError> {
    let mut text = Vec::new();
    File::open(file)
        .and_then(|file| file.take(MAX_FILE).read_to_end(&mut text))
        .map_err(|error| InputError::unreadable(shown(file), &error))?;
    let found: Result<Vec<T>, _> = T::pem_slice_iter(&text).collect();
    match found {
        Ok(found) if !found.is_empty() => Ok(found),
        Ok(_) => Err(InputError::new(shown(file), format!("expected {what} in PEM, found none"))),
        Err(_) => Err(InputError::new(shown(file), format!("expected {what} in PEM, found a damaged section"))),
    }
}

/// A new certificate for one host, which can sign no others, and its key.
fn pem(host: &Host) -> Result<String, InputError> {
    let make = || {
        let key = rcgen::KeyPair::generate()?;
        let mut params = rcgen::CertificateParams::new([host.to_string()])?;
        let now = SystemTime::now();
        (params.not_before, params.not_after) = ((now - BEFORE).into(), (now + AFTER).into());
        params.is_ca = rcgen::IsCa::ExplicitNoCa;
        params.key_usages = vec![rcgen::KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![rcgen::ExtendedKeyUsagePurpose::ServerAuth];
        params.distinguished_name = rcgen::DistinguishedName::new();
        params.distinguished_name.push(rcgen::DnType::CommonName, format!("teachtree on {host}"));
        Ok(params.self_signed(&key)?.pem() + &key.serialize_pem())
    };
    make().map_err(|error: rcgen::Error| InputError::new("the certificate", format!("cannot be made: {error}")))
}
