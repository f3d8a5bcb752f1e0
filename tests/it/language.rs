//! Tests of `language`.

use std::path::PathBuf;
use teachtree::base::diagnostic::render;
use teachtree::language::{self, Loaded, Request, SHIPPED};

fn report(loaded: &Loaded) -> String {
    render(&loaded.diagnostics, &loaded.sources, false)
}

#[test]
fn shipped_files_load_without_a_word() {
    for (name, _) in SHIPPED {
        for hand in ["rules/hand_force.rules", "hand_flags.rules"] {
            let request = Request {
                files: vec![PathBuf::from(format!("rules/{name}"))],
                hand_file: Some(hand.to_string()),
                ..Request::default()
            };
            let loaded = language::load(&request);
            assert_eq!(report(&loaded), "", "{name} with {hand}");
            assert!(loaded.rules.is_some());
        }
    }
}
