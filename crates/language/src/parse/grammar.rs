//! The pest grammar.

/// Tokens that a declaration (of a tree: a choice) may have.
pub const MAX_TOKENS: usize = 4000;

/// The derived parser.
#[derive(pest_derive::Parser)]
#[grammar = "../../grammar/tokens.pest"]
#[grammar = "../../grammar/expressions.pest"]
#[grammar = "../../grammar/declarations.pest"]
pub struct Grammar;
