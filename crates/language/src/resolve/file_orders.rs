//! `use "tap.rules" before "shake.rules"`: which file comes first where both extend a tree at one place.

use super::Resolver;
use crate::codes;
use crate::source::used_file;
use crate::syntax::Name;
use std::collections::BTreeMap;
use teachtree_base::diagnostic::Diagnostic;

impl Resolver {
    /// Fills [`Resolver::file_order`], closed under transitivity; reports files that are not loaded and orders that contradict each other.
    pub(super) fn file_orders(&mut self, orders: &[(&Name, &Name)]) {
        let mut said: BTreeMap<(u32, u32), &Name> = BTreeMap::new();
        for (file, before) in orders {
            let Some(first) = used_file(file, &self.rules.sources) else { continue };
            let Some(second) = used_file(before, &self.rules.sources) else {
                let files = self.rules.sources.files.iter().map(|source| source.name.clone()).collect();
                self.unknown("file in this rule set named", &before.text, before.span, |_| files);
                continue;
            };
            if first == second {
                self.report(
                    Diagnostic::error(codes::CIRCULAR_ORDER, "a file comes before itself")
                        .at(before.span, "the same file")
                        .help("name the other file"),
                );
                continue;
            }
            if self.file_order.contains(&(second, first)) {
                let mut finding = Diagnostic::error(codes::CIRCULAR_ORDER, "the orders of the files form a cycle")
                    .at(before.span, "this closes the cycle");
                for (_, place) in said.iter().filter(|((from, to), _)| *from == second || *to == first) {
                    finding = finding.at(place.span, "said here");
                }
                self.report(finding.help("leave one of the orders out"));
                continue;
            }
            said.insert((first, second), before);
            // The order is transitive.
            let ahead = self.file_order.iter().filter(|(_, to)| *to == first).map(|(from, _)| *from);
            let ahead: Vec<u32> = ahead.chain([first]).collect();
            let behind = self.file_order.iter().filter(|(from, _)| *from == second).map(|(_, to)| *to);
            let behind: Vec<u32> = behind.chain([second]).collect();
            self.file_order.extend(ahead.iter().flat_map(|from| behind.iter().map(move |to| (*from, *to))));
        }
    }

    /// Whether a rule file says that the extensions of `first` come before those of `second`.
    pub fn comes_before(&self, first: u32, second: u32) -> bool {
        self.file_order.contains(&(first, second))
    }
}
