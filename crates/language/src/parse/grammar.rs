//! The parser that pest makes of `grammar/*.pest`. ARCHITECTURE.md, "Adding an operator", lists what else an operator needs.

/// Tokens that a declaration (of a tree: a choice) may have.
pub const MAX_TOKENS: usize = 4000;

/// The derived parser.
#[derive(pest_derive::Parser)]
#[grammar = "../../grammar/tokens.pest"]
#[grammar = "../../grammar/expressions.pest"]
#[grammar = "../../grammar/declarations.pest"]
pub struct Grammar;
