//! What is known of a new primitive, for people.

use super::{NewPrimitive, duration_s};
use std::fmt::Write;
use teachtree_learn::{FoundInterval, Recognition};
use teachtree_session::{Error, Log};

/// The least agreement of guards at which a labeled interval is certain.
const CERTAIN: f64 = 0.9;

impl NewPrimitive {
    /// The recording of an interval.
    pub fn log(&self, at: usize) -> &Log {
        self.recordings.get(at).map_or_else(|| &self.demonstrations[at - self.recordings.len()], |one| &one.log)
    }

    /// The intervals of the recordings that a person should label, least certain first.
    pub fn questions(&self) -> Vec<&FoundInterval> {
        let is_question = |it: &&FoundInterval| {
            it.recording < self.recordings.len() && (it.is_found != it.is_marked || it.agreement < CERTAIN)
        };
        self.extension.intervals.iter().filter(is_question).collect()
    }

    /// How well it is found, the proof, and how often it is found elsewhere, one a line.
    ///
    /// # Errors
    /// A recording that cannot be read.
    pub fn summary(&self) -> Result<String, Error> {
        let [conditions, places] = self.extension.tried;
        let count = self.recordings.len();
        let mut text = format!(
            "{count} recordings, {} of them with {} labeled intervals of {}; {conditions} conditions at {places} places of the tree\n\n",
            self.marked, self.extension.learned.marked, self.name
        );
        for (name, it) in [("learned from", self.extension.learned), ("held out", self.extension.held_out)] {
            let Recognition { marked, found, matched, .. } = it;
            let (others, overlap) = (found.saturating_sub(matched), it.overlap() * 100.0);
            let _ = writeln!(
                text,
                "{name:<14}{matched} of {marked} intervals found, {others} others, overlap {overlap:.1} %"
            );
        }
        self.add_proof(&mut text);
        let unlabeled: Vec<usize> = (0..count).filter(|at| self.recordings[*at].tracks.is_empty()).collect();
        let shipped: Vec<usize> = (count..count + self.demonstrations.len()).collect();
        self.add_elsewhere(&mut text, "recordings without labels", &unlabeled)?;
        self.add_elsewhere(&mut text, "shipped demonstrations of other tasks", &shipped)?;
        if shipped.is_empty() {
            text.push_str("the shipped demonstrations lack channels that the rules read: no other task was examined\n");
        }
        Ok(text)
    }

    fn add_proof(&self, text: &mut String) {
        let proof = &self.extension.proof;
        if proof.is_proved() {
            text.push_str("proved: it only adds to the rules\n");
            return;
        }
        text.push_str("not proved that it only adds to the rules\n");
        for finding in &proof.findings {
            let _ = writeln!(text, "  {}   {}", finding.what, finding.place);
        }
    }

    fn add_elsewhere(&self, text: &mut String, name: &str, recordings: &[usize]) -> Result<(), Error> {
        if recordings.is_empty() {
            return Ok(());
        }
        let found = || self.extension.intervals.iter().filter(|it| it.is_found && recordings.contains(&it.recording));
        // The sum of nothing is −0.
        let found_s = found().fold(0.0, |sum, it| sum + it.time_s[1] - it.time_s[0]);
        let all_s: f64 = recordings.iter().map(|at| duration_s(self.log(*at))).sum::<Result<f64, Error>>()?;
        let _ = writeln!(
            text,
            "{} {name}: found {} times, {found_s:.1} s of {all_s:.1} s ({:.1} %)",
            recordings.len(),
            found().count(),
            100.0 * found_s / all_s.max(f64::MIN_POSITIVE)
        );
        Ok(())
    }
}
