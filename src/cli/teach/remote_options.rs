//! The options by which other machines open the page of `teach --live`.

use std::path::PathBuf;
use teachtree_base::error::InputError;
use teachtree_serve::{Host, Server};

/// Options of a page that other machines open.
#[derive(clap::Args)]
pub struct RemoteArgs {
    /// With --live: serve the page with TLS to other machines, under this name or address of this machine
    #[arg(long, value_name = "HOST", value_parser = Host::parse)]
    host: Option<Host>,
    /// With --host: PEM file of the certificate and its key; created for the host if missing. By default the certificate is kept in memory
    #[arg(long, value_name = "FILE", requires = "host")]
    certificate: Option<PathBuf>,
    /// With --certificate: PEM file of the key, if separate
    #[arg(long, value_name = "FILE", requires = "certificate")]
    key: Option<PathBuf>,
}

impl RemoteArgs {
    pub fn is_given(&self) -> bool {
        self.host.is_some()
    }

    /// Files that are read, and that no recording may replace.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.certificate.iter().chain(&self.key)
    }

    /// The server for other machines where it is asked for, and by what they know it.
    ///
    /// # Errors
    /// A certificate that cannot be used, an address that cannot be listened on, a program without TLS.
    #[cfg(feature = "tls")]
    pub fn server(&self, port: u16) -> Result<Option<(Server, String)>, InputError> {
        use teachtree_serve::Certificate;
        let Some(host) = &self.host else { return Ok(None) };
        let (certificate, of) = match (&self.certificate, &self.key) {
            (Some(file), key) if key.is_some() || file.exists() => {
                (Certificate::open(file, key.as_ref().unwrap_or(file), host)?, format!(" in {}", file.display()))
            }
            (Some(file), _) => {
                let certificate = Certificate::make_file(file, host)?;
                (certificate, format!(", signed by itself and new in {}", file.display()))
            }
            (None, _) => (Certificate::make(host)?, ", signed by itself and new".into()),
        };
        let proof = format!("certificate{of}; SHA-256 fingerprint:\n{}", certificate.fingerprint());
        Ok(Some((Server::for_others(host, port, &certificate)?, proof)))
    }

    /// The same, without TLS.
    #[cfg(not(feature = "tls"))]
    pub fn server(&self, _port: u16) -> Result<Option<(Server, String)>, InputError> {
        match &self.host {
            None => Ok(None),
            Some(_) => Err(InputError::new("--host", "this program was built without the feature `tls`")
                .help("build it with `cargo install --path . --locked --features tls` (docs/teaching.md)")),
        }
    }
}
