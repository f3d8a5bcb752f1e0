//! One test binary: each module is a floor seen from outside.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod accessibility;
mod analysis;
mod annotate;
mod annotate_forms;
mod audit;
mod both_hands;
mod bounds;
mod browser;
mod cli;
mod command;
mod composites;
mod confidence;
mod diagram;
mod digests;
mod door;
mod editors;
mod engine;
mod expectations;
mod explain;
mod extremes;
#[cfg(unix)]
mod faults;
mod fit;
mod foreign;
mod frame_table;
mod graph;
mod gripper;
mod hostile;
mod input_schemas;
mod inspect;
mod labeled_bags;
mod language;
#[cfg(unix)]
mod links;
mod live;
mod live_calibration;
mod live_faults;
mod live_log;
mod live_memory;
mod live_program;
mod live_robot;
mod live_serve;
mod live_topics;
#[cfg(feature = "zenoh")]
mod live_zenoh;
mod lsp;
mod many_logs;
mod mimicgen;
#[cfg(unix)]
mod pipes;
mod plugs;
mod primitives;
mod program;
mod prove;
mod recognition;
mod recordings;
mod refused;
mod report;
mod robot;
mod robust;
mod scenarios;
mod schemas;
mod score;
mod sets;
mod signals;
mod stream;
mod studio;
mod subjects;
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
