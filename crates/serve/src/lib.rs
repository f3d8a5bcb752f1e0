//! Local pages: a server that answers only who has its address, on loopback, or by TLS for other machines.
//!
//! `http` reads requests and writes responses, both bounded; `server` listens, and checks token, host and origin; `visitors` are the connections that are open.
//! `host` is how other machines reach this one, and `certificate` proves to them which one it is. What a page answers is decided by the crate that
//! implements it ([`Page`]).

#[cfg(feature = "tls")]
mod certificate;
pub mod duplex;
mod host;
mod http;
mod server;
#[cfg(feature = "tls")]
mod tls;
mod visitors;

#[cfg(feature = "tls")]
pub use certificate::Certificate;
pub use host::Host;
pub use http::{Content, Request, Response};
pub use server::{Page, Server};
