//! The page of `report`, used in a browser.

#[path = "../../crates/analysis/tests/it/analysis/build.rs"]
#[allow(dead_code, reason = "the tests of `analysis` use all of it")]
mod build;
mod drawn;
pub mod page;
#[path = "../../crates/report/tests/it/report/pages.rs"]
#[allow(dead_code, reason = "the tests of `report` use all of it")]
mod pages;
