//! The threads of `teach --live`.

use super::labels::Labeler;
use super::options::Options;
use super::punctuality::Punctuality;
use super::servo;
use super::shared_state::Teaching;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use teachtree_base::error::InputError;
use teachtree_world::TeleopWorld;

/// Maximum number of rows that wait for labels.
const MOST_ROWS: usize = 4096;

/// Starts the threads with the scene at rest. The returned channel receives the timing statistics of the servo when it ends.
///
/// # Errors
/// A scene that cannot be simulated, rules that cannot be loaded for its recordings.
pub fn begin(options: Options) -> Result<(Arc<Teaching>, Receiver<Punctuality>), InputError> {
    let work = TeleopWorld::new(&options.scene)?;
    let (labeler, styles) = Labeler::new(&options)?;
    let teaching = Arc::new(Teaching::new(options, styles));
    let (to_labels, rows) = sync_channel(MOST_ROWS);
    let (ended, punctuality) = sync_channel(1);
    std::thread::spawn({
        let teaching = Arc::clone(&teaching);
        move || labeler.run(&rows, &teaching.tracks)
    });
    std::thread::spawn({
        let teaching = Arc::clone(&teaching);
        move || {
            let punctuality = servo::run(work, &teaching, &to_labels);
            // The receiver may be gone.
            let _ = ended.send(punctuality);
        }
    });
    Ok((teaching, punctuality))
}
