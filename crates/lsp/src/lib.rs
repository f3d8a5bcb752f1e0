//! The language server: rule files as editors see them, over the Language Server Protocol on standard input and output.
//!
//! Comes in: messages of an editor. Goes out: answers and diagnostics. `wire` reads messages, `server` gives each to who answers it,
//! `workspace` knows the open files and what the compiler says of them; the other files answer one kind of question each.
//! It holds no rule of the language itself: all that it says is of `language`, and the values of a recording are of `analysis`.
//!
//! INVARIANTS: the server runs until the client requests its exit or the input ends, even after invalid input; it writes only messages, and
//! files of the cache.

mod actions;
mod completion;
mod findings;
mod hover;
mod language_service;
mod library;
mod lines;
mod navigation;
mod outline;
mod recording;
mod rename;
mod server;
mod settings;
mod uri;
mod wire;
mod workspace;

pub use language_service::{LanguageService, Proposal};
pub use server::serve;
pub use settings::Settings;

use lsp_server::ErrorCode;
use std::path::Path;
use teachtree_base::error::InputError;

/// Validates the text of a YAML file at a path: a scene, an operator script, a binding or a robot file. Returns nothing for other files.
pub type FileValidator = fn(&Path, &str) -> Option<InputError>;

/// The error of a request.
#[derive(Debug)]
struct RequestError {
    code: ErrorCode,
    message: String,
}

impl RequestError {
    /// A request that was understood and cannot be done.
    fn failed(message: impl Into<String>) -> Self {
        Self { code: ErrorCode::RequestFailed, message: message.into() }
    }
}

type Answer<T> = Result<T, RequestError>;
