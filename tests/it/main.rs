//! One test binary: each module is a floor seen from outside.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

#[cfg(all(feature = "world", feature = "cli", feature = "studio", feature = "parquet", feature = "hdf5"))]
mod accessibility;
mod analysis;
#[cfg(all(feature = "cli", feature = "parquet", feature = "hdf5"))]
mod annotate;
#[cfg(all(feature = "cli", feature = "parquet", feature = "hdf5"))]
mod annotate_forms;
#[cfg(all(feature = "world", feature = "cli", feature = "parquet", feature = "hdf5"))]
mod audit;
#[cfg(feature = "world")]
mod both_hands;
#[cfg(all(feature = "world", feature = "cli", feature = "parquet"))]
mod bounds;
#[cfg(all(feature = "world", feature = "cli"))]
mod browser;
#[cfg(feature = "world")]
mod cli;
#[cfg(all(feature = "world", feature = "cli"))]
mod command;
#[cfg(all(feature = "world", feature = "cli"))]
mod composites;
#[cfg(all(feature = "world", feature = "cli"))]
mod confidence;
#[cfg(all(feature = "world", feature = "cli"))]
mod diagram;
#[cfg(all(feature = "world", feature = "cli"))]
mod door;
mod editors;
mod engine;
#[cfg(feature = "cli")]
mod expectations;
#[cfg(feature = "cli")]
mod explain;
mod extremes;
#[cfg(all(feature = "world", feature = "cli", feature = "parquet", unix))]
mod faults;
#[cfg(feature = "cli")]
mod fit;
mod foreign;
#[cfg(all(feature = "world", feature = "cli"))]
mod frame_table;
mod graph;
#[cfg(all(feature = "cli", feature = "parquet", feature = "hdf5"))]
mod gripper;
#[cfg(all(feature = "world", feature = "cli"))]
mod hostile;
#[cfg(all(feature = "world", feature = "cli"))]
mod input_schemas;
#[cfg(feature = "cli")]
mod inspect;
#[cfg(all(feature = "cli", feature = "mcap"))]
mod labeled_bags;
mod language;
#[cfg(all(feature = "world", feature = "studio", feature = "parquet", feature = "hdf5", unix))]
mod links;
#[cfg(feature = "cli")]
mod live;
#[cfg(all(feature = "world", feature = "cli"))]
mod live_calibration;
#[cfg(all(feature = "world", feature = "cli"))]
mod live_faults;
#[cfg(all(feature = "world", feature = "cli"))]
mod live_log;
#[cfg(all(feature = "world", feature = "cli"))]
mod live_memory;
#[cfg(all(feature = "world", feature = "cli"))]
mod live_program;
#[cfg(all(feature = "cli", feature = "net"))]
mod live_robot;
#[cfg(all(feature = "world", feature = "cli", feature = "net"))]
mod live_serve;
#[cfg(all(feature = "cli", feature = "mcap"))]
mod live_topics;
#[cfg(all(feature = "world", feature = "zenoh"))]
mod live_zenoh;
#[cfg(all(feature = "lsp", feature = "cli"))]
mod lsp;
mod many_logs;
#[cfg(feature = "hdf5")]
mod mimicgen;
#[cfg(all(feature = "world", feature = "studio", feature = "parquet", feature = "hdf5", unix))]
mod pipes;
#[cfg(all(feature = "world", feature = "cli"))]
mod plugs;
#[cfg(feature = "cli")]
mod primitives;
mod program;
#[cfg(feature = "cli")]
mod prove;
mod recognition;
#[cfg(feature = "world")]
mod recordings;
#[cfg(all(feature = "world", feature = "cli"))]
mod refused;
mod report;
#[cfg(feature = "world")]
mod robot;
#[cfg(feature = "cli")]
mod robust;
mod scenarios;
#[cfg(all(feature = "world", feature = "cli"))]
mod schemas;
mod score;
#[cfg(all(feature = "cli", feature = "parquet", feature = "hdf5"))]
mod sets;
#[cfg(all(feature = "cli", feature = "parquet", feature = "hdf5"))]
mod signals;
mod stream;
#[cfg(all(feature = "world", feature = "studio", feature = "parquet", feature = "hdf5"))]
mod studio;
#[cfg(feature = "world")]
mod subjects;
#[cfg(all(feature = "teach", unix))]
mod teach_camera;
#[cfg(all(feature = "teach", unix))]
mod teach_live;
#[cfg(all(feature = "teach", unix))]
mod teach_page;
mod teach_tls;
#[cfg(all(feature = "world", feature = "cli"))]
mod teleoperated;
mod tidy;
#[cfg(all(feature = "cli", feature = "mcap"))]
mod views;
#[cfg(feature = "cli")]
mod vision;
#[cfg(all(feature = "cli", unix))]
mod waiting;
#[cfg(all(feature = "world", feature = "cli"))]
mod worked_example;
#[cfg(feature = "world")]
mod world;
