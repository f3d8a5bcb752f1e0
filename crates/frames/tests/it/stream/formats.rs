//! Readers: files of every format in, tables and recordings out.

mod arrays;
mod cells;
mod clocks;
mod columnar;
mod conventions;
mod damaged;
mod joined;
mod lines;
mod messages;
mod promises;
mod storages;
mod stores;
mod text;

use crate::shared::files::{bound, bound_text, fixture, folder, header, stamps, values};

#[test]
fn what_is_not_a_log_is_refused() {
    let folder = folder(&[("log.db3", "SQLite format 3"), ("picture.png", "\u{89}PNG"), ("empty/readme.md", "")]);
    let refused = |name: &str| bound(&folder.path().join(name), "").unwrap_err();
    insta::assert_snapshot!(
        [refused("log.db3"), refused("picture.png"), refused("empty"), refused("log.db3#3")].join("\n")
    );
}
