//! Messages of an MCAP file in the order in which they were recorded, also while the file is being written.

use super::source::{Outlet, SourceEvent, message};
use std::fs::File;
use std::io::Read;
use std::thread;
use std::time::Duration;
use teachtree_base::error::InputError;
use teachtree_frames::bind::TopicFilter;
use teachtree_logs::read::formats::mcap;

/// Interval at which a file is checked for new data.
const LOOK: Duration = Duration::from_millis(20);

/// Sends the messages of a file to its end.
pub fn play(file: File, name: &str, topics: &TopicFilter, followed: bool, outlet: &Outlet) {
    // Reading ends when the consumer is gone.
    let gone = || InputError::new(name, "its reader has ended");
    let each = &mut |topic: &str, reading: &_, recorded_ns: i64, bytes: &[u8]| {
        if !topics.takes(topic) || outlet.send(message(topic, reading, recorded_ns, bytes)) {
            Ok(())
        } else {
            Err(gone())
        }
    };
    let played = match followed {
        true => mcap::play(GrowingFile { file, outlet: outlet.clone() }, name, each),
        false => mcap::play(file, name, each),
    };
    let _ = outlet.send(match played {
        Ok(_) => SourceEvent::Stop,
        Err(error) => SourceEvent::Failed(error),
    });
}

/// A file that is being written: its end is waited at.
struct GrowingFile {
    file: File,
    outlet: Outlet,
}

impl Read for GrowingFile {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        loop {
            match self.file.read(buffer) {
                Ok(0) if !buffer.is_empty() && !self.outlet.stops() => thread::sleep(LOOK),
                read => return read,
            }
        }
    }
}
