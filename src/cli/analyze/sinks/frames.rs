//! `analyze --frames`: a table with a row for each frame.

use super::Sink;
use teachtree_logs::read::formats;
use teachtree_session::{ErrorInternals, FrameTableInternals};

pub(super) const SINK: Sink = Sink {
    check: |_, path, _| formats::check_name(path),
    ..Sink::new(["--frames", "a table of frames"], |args, path, _, analysis| {
        let table = analysis.frames(&args.signals())?;
        Ok(Box::new(move |files, _| table.add(files, path).map_err(ErrorInternals::into_input)))
    })
};
