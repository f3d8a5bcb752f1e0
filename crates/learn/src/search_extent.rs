//! How far a search went.

use std::ops::AddAssign;

/// What searches have tried; those of several searches add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SearchExtent {
    /// How many versions of the rules were tried.
    pub versions: usize,
    /// Whether a search ended before all of its changes were tried, because its work is bounded.
    pub is_cut: bool,
}

impl SearchExtent {
    /// For people: `tried 812 versions of mine.rules`.
    pub fn text(self, rules: &str) -> String {
        let Self { versions, is_cut } = self;
        if is_cut {
            format!("the search stopped after {versions} versions of {rules}; some changes were not tried")
        } else {
            format!("tried {versions} versions of {rules}")
        }
    }
}

impl AddAssign for SearchExtent {
    fn add_assign(&mut self, other: Self) {
        self.versions += other.versions;
        self.is_cut |= other.is_cut;
    }
}
