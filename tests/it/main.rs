//! Tests of the program and of the public interface. Each crate has its own tests beside it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod accessibility;
mod advice;
mod annotate;
mod annotate_forms;
mod audit;
mod audit_signals;
mod bounds;
mod browser;
mod ci_formats;
mod cli;
mod command;
mod composites;
mod confidence;
mod diagram;
mod door;
mod examples;
mod expectations;
mod explain;
mod export;
mod extremes;
mod failures;
#[cfg(unix)]
mod faults;
mod fit;
mod foreign;
mod frame_table;
mod generated_pages;
mod gripper;
mod gripper_hold;
mod hostile;
mod init;
mod input_schemas;
mod inspect;
mod labeled_bags;
mod learn;
#[cfg(unix)]
mod links;
mod live;
mod live_calibration;
mod live_faults;
mod live_lacking;
mod live_log;
mod live_memory;
mod live_program;
mod live_robot;
mod live_serve;
mod live_topics;
mod live_values;
#[cfg(feature = "zenoh")]
mod live_zenoh;
mod lsp;
mod many_logs;
mod mimicgen;
mod misplaced;
#[cfg(unix)]
mod outcomes;
mod pipes;
mod plugs;
mod primitives;
mod program;
mod project_file;
mod prove;
mod recognition;
mod recordings;
mod refused;
mod report;
mod robot;
mod robust;
mod schemas;
mod score;
mod sets;
#[path = "../../crates/frames/tests/it/shared/mod.rs"]
#[allow(dead_code, reason = "the tests of `frames` use all of it")]
mod shared;
mod shipped_failures;
mod signals;
mod since_1970;
mod stream;
mod studio;
mod subjects;
mod success_fields;
#[cfg(unix)]
mod teach_camera;
#[cfg(unix)]
mod teach_live;
#[cfg(unix)]
mod teach_page;
mod teach_tls;
mod teleoperated;
mod tidy;
mod views;
mod vision;
#[cfg(unix)]
mod waiting;
mod worked_example;
mod world;

/// The folder of the project.
const ROOT: &str = env!("CARGO_MANIFEST_DIR");
