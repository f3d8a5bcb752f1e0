//! Local pages: a server on loopback that answers only who has its address.
//!
//! `http` reads requests and writes responses, both bounded; `server` listens, and checks token, host and origin. What a page answers is the business of
//! the module that has it ([`Page`]).

mod http;
mod server;

pub use http::{Content, Request, Response};
pub use server::{Page, Server};
