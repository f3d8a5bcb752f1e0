//! The name or the address by which other machines reach this one.

use std::fmt;
use std::net::IpAddr;

/// A host as it stands in addresses of pages, in small letters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Host {
    /// An address of this machine.
    Address(IpAddr),
    /// A name that leads to it.
    Name(String),
}

impl Host {
    /// Reads `192.168.1.5`, `::1` or `bench.local`.
    ///
    /// # Errors
    /// Anything else: a port, a path, an address that no machine has.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wanted = "expected a name or an address of this machine that others reach, such as 192.168.1.5";
        if let Ok(address) = text.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>() {
            return if address.is_unspecified() { Err(wanted.into()) } else { Ok(Self::Address(address)) };
        }
        let is_label = |label: &str| {
            (1..=63).contains(&label.len())
                && label.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-')
                && !label.starts_with('-')
                && !label.ends_with('-')
        };
        // What ends in a number would be an address.
        let is_name = text.len() <= 253
            && text.split('.').all(is_label)
            && text.rsplit('.').next().is_some_and(|last| last.bytes().any(|byte| !byte.is_ascii_digit()));
        if is_name { Ok(Self::Name(text.to_ascii_lowercase())) } else { Err(wanted.into()) }
    }

    /// Where to listen: a name may lead to any network of this machine.
    pub fn listens_on(&self) -> IpAddr {
        match self {
            Self::Address(address) => *address,
            Self::Name(_) => std::net::Ipv4Addr::UNSPECIFIED.into(),
        }
    }

    /// The origin of pages on a port, as browsers send it: without the usual port.
    pub fn origin(&self, port: u16) -> String {
        let host = match self {
            Self::Address(IpAddr::V6(address)) => format!("[{address}]"),
            host => host.to_string(),
        };
        if port == 443 { format!("https://{host}") } else { format!("https://{host}:{port}") }
    }
}

impl fmt::Display for Host {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address(address) => write!(f, "{address}"),
            Self::Name(name) => f.write_str(name),
        }
    }
}
