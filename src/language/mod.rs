//! The rule language: text in, a checked rule set and diagnostics out. It knows no log and no robot.

pub mod rules;

pub use rules::Rules;
