//! `analyze --report`: a page for browsers.

use super::Sink;
use crate::cli::output;

pub(super) const SINK: Sink = Sink {
    has_signals: false,
    ..Sink::new(["--report", "a report"], |_, path, _, analysis| {
        let page = analysis.html()?;
        Ok(Box::new(move |files, inputs| output::add(files, path, &page, inputs)))
    })
};
