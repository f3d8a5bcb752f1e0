//! `cargo bench -p teachtree-measure --bench engine`: the compiled rules compared with the same jobs written by hand, in the same run, on one core;
//! the cost of windows, live frames and compilation. `cargo bench -p teachtree-measure --bench engine -- streaming` runs one section; `week`, which takes
//! minutes, runs only on request.
//!
//! The labels of all candidates are compared frame by frame. Each figure is printed with its target.
#![allow(missing_docs, reason = "a program")]
#![allow(
    clippy::print_stdout,
    clippy::expect_used,
    clippy::panic,
    reason = "a program that stops when something is wrong"
)]

mod compilation;
mod job;
mod live;
mod shipped;
mod streaming;
mod timing;
mod windows;

/// The sections by name.
const SECTIONS: [(&str, fn()); 9] = [
    ("job", job::section),
    ("one_hand", shipped::one_hand),
    ("two_hands", shipped::two_hands),
    ("windows", windows::section),
    ("streaming", streaming::section),
    ("week", streaming::week),
    ("live", live::section),
    ("compilation", compilation::section),
    ("ready", compilation::ready),
];
/// The sections that run only on request.
const ASKED_FOR: [&str; 2] = ["week", "ready"];

fn main() {
    // Paths of rules, logs and robots are those of the repository.
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).expect("the folder of the repository");
    // Cargo itself adds `--bench`.
    let asked: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    if let Some(unknown) = asked.iter().find(|name| SECTIONS.iter().all(|(section, _)| section != name)) {
        let known: Vec<&str> = SECTIONS.iter().map(|(name, _)| *name).collect();
        panic!("there is no section `{unknown}`; sections are {}", known.join(", "));
    }
    for (name, section) in SECTIONS {
        if asked.is_empty() && !ASKED_FOR.contains(&name) || asked.iter().any(|asked| asked == name) {
            section();
        }
    }
}
