//! Logs of all formats: reading, writing, the names of their columns, and the issues found in them.

#![cfg_attr(
    not(all(
        feature = "parquet",
        feature = "mcap",
        feature = "db3",
        feature = "protobuf",
        feature = "hdf5",
        feature = "arrays"
    )),
    allow(dead_code, unused_imports, reason = "formats share code, and some are left out")
)]

pub mod allowed_folders;
pub mod atomic_write;
#[cfg(feature = "mcap")]
pub mod foxglove;
pub mod issue;
pub mod names;
pub mod read;
