//! The language server: rule files as editors see them, over the Language Server Protocol on standard input and output.
//!
//! Comes in: messages of an editor. Goes out: answers and diagnostics. `wire` reads messages, `server` gives each to who answers it,
//! `workspace` knows the open files and what the compiler says of them; the other files answer one kind of question each.
//! It holds no rule of the language itself: all that it says is of `language`, and the values of a recording are of `analysis`.
//!
//! INVARIANTS: whatever comes in, the server goes on until it is asked to exit or the input ends; nothing is written but messages, and
//! files of the cache.

mod actions;
mod complete;
mod findings;
mod hover;
mod library;
mod lines;
mod navigate;
mod outline;
mod recording;
mod rename;
mod server;
mod settings;
mod sheet;
mod uri;
mod wire;
mod workspace;

pub use server::serve;
pub use settings::Settings;
pub use sheet::{Proposal, Sheet};

use lsp_server::ErrorCode;
use std::path::Path;
use teachtree_base::error::InputError;

/// What is wrong with the text of a YAML file at a path: a scene, an operator script, a binding or a robot file. Nothing for other files.
pub type Wrong = fn(&Path, &str) -> Option<InputError>;

/// Why a request has no answer.
#[derive(Debug)]
struct Refused {
    code: ErrorCode,
    message: String,
}

impl Refused {
    /// A request that was understood and cannot be done.
    fn failed(message: impl Into<String>) -> Self {
        Self { code: ErrorCode::RequestFailed, message: message.into() }
    }
}

type Answer<T> = Result<T, Refused>;
