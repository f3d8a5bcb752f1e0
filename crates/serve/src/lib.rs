//! Local pages: a server that answers only who has its address, on loopback, or by TLS for other machines.
//!
//! `http` reads requests and writes responses, both bounded; `server` listens, and checks token, host and origin; `connections` limits the open connections.
//! `host` is how other machines reach this one, and `certificate` proves to them which one it is. What a page answers is decided by the crate that
//! implements it ([`Page`]).

#[cfg(feature = "tls")]
mod certificate;
mod connections;
pub mod duplex_stream;
mod host;
mod http;
mod server;
#[cfg(feature = "tls")]
mod tls;

#[cfg(feature = "tls")]
pub use certificate::Certificate;
pub use host::Host;
pub use http::{Content, Request, Response};
pub use server::{Page, Server};
