//! `--format eaf`: a file of ELAN, of one recording.

use super::Writer;
use teachtree_base::error::InputError;

pub const WRITER: Writer = Writer {
    check: |logs| match logs {
        0 | 1 => Ok(()),
        _ => Err(InputError::new("--format", "a file of ELAN is written for one recording, found several")
            .help("name a folder with --out-dir, which gets a file for each")),
    },
    omits_issues: true,
    ..Writer::new("eaf", |analysis, _| Ok(analysis.eaf()))
};
