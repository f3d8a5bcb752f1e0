//! The recording whose values are shown beside the rules, at one time.

use super::settings::Settings;
use std::rc::Rc;
use std::time::SystemTime;
use teachtree_analysis::explain::{frame_at, value};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::Inspector;
use teachtree_language::Rules;
use teachtree_language::rules::Expr;
use teachtree_session::LogInternals;
use teachtree_session::{Log, Run};

/// Size of a file, and when it was written.
type Stamp = Option<(u64, SystemTime)>;

/// The recording as the settings want it.
#[derive(Default)]
pub struct Recording {
    settings: Settings,
    stamp: Stamp,
    log: Option<Log>,
    /// The last rules that were run on it, by their digest.
    run: Option<(String, Rc<Run>)>,
}

impl Recording {
    /// Opens the configured recording; opens a changed file again. Returns whether anything changed. After an error
    /// no recording is open.
    pub fn open(&mut self, settings: &Settings) -> Result<bool, String> {
        let file = settings.log.as_ref().and_then(|log| std::fs::metadata(log).ok());
        let stamp = file.and_then(|file| Some((file.len(), file.modified().ok()?)));
        let with = |settings: &Settings| (settings.log.clone(), settings.binding.clone(), settings.scene.clone());
        let same = with(&self.settings) == with(settings) && self.stamp == stamp;
        self.settings = settings.clone();
        if same {
            return Ok(false);
        }
        (self.stamp, self.log, self.run) = (stamp, None, None);
        let Some(log) = settings.log.clone() else { return Ok(true) };
        let options =
            settings.binding.iter().fold(Log::options().by_project(), |options, binding| options.binding(binding));
        let options = settings.scene.iter().fold(options, |options, scene| options.scene(scene));
        let log = options.open(log).and_then(|log| log.read().map(|()| log));
        self.log = Some(log.map_err(|error| error.to_string())?);
        Ok(true)
    }

    /// What is open.
    pub const fn log(&self) -> Option<&Log> {
        self.log.as_ref()
    }

    /// What an expression is worth at the time that is set, of each hand when it is `per_hand`, as Markdown. `None` without a recording;
    /// errors say why nothing is known.
    pub fn value(&mut self, rules: &Rules, expr: &Expr, per_hand: bool) -> Option<Result<String, String>> {
        self.inspect(rules, expr, |inspector, expr, frame| {
            let hands: Vec<Option<Side>> = if per_hand { sides(inspector).map(Some).collect() } else { vec![None] };
            hands.into_iter().map(|hand| Ok((hand, value(inspector, expr, hand, frame)?))).collect()
        })
    }

    /// What the trees give at the time that is set, before settling: of each hand, and of both. Otherwise as [`Recording::value`].
    pub fn leaves(&mut self, rules: &Rules) -> Option<Result<String, String>> {
        self.inspect(rules, &(), |inspector, (), frame| {
            let tracks = sides(inspector).map(Some).chain([None]).filter(|side| inspector.tree(*side).is_some());
            let leaf =
                |side| inspector.leaf(side, frame).map_or("separate".to_string(), |label| rules.label_name(label));
            Ok(tracks.map(|side| (side, vec![leaf(side)])).collect())
        })
    }

    /// The values on a frame, of each hand or of none: the value first, then the lines that explain it. The inspector may keep what it is asked `about`.
    fn inspect<T>(
        &mut self,
        rules: &Rules,
        about: &T,
        values: impl for<'a> FnOnce(
            &mut Inspector<'a>,
            &'a T,
            usize,
        ) -> Result<Vec<(Option<Side>, Vec<String>)>, InputError>,
    ) -> Option<Result<String, String>> {
        let name = self.log.as_ref()?.path().file_name()?.to_string_lossy().into_owned();
        let run = match self.run(rules) {
            Ok(run) => run,
            Err(error) => return Some(Err(error)),
        };
        let beginning = run.frames.time.first().copied().unwrap_or_default();
        let time_s = self.settings.time_s().ok().flatten().unwrap_or(beginning);
        let Some((leaves, frame)) = frame_at(&run.frames, &run.leaves, time_s) else {
            let end = run.frames.time.last().copied().unwrap_or_default();
            let range = format!("which goes from {beginning:.3} s to {end:.3} s");
            return Some(Err(format!("nothing is known at {time_s:.3} s of `{name}`, {range}")));
        };
        let values = match values(&mut Inspector::new(rules, &run.frames, leaves), about, frame) {
            Ok(values) => values,
            Err(error) => return Some(Err(error.to_string())),
        };
        let mut text = format!("at {time_s:.3} s of `{name}`");
        for (hand, lines) in values {
            let whose = hand.map_or(String::new(), |side| format!("{side} "));
            for (at, line) in lines.iter().enumerate() {
                text.push_str(&if at == 0 { format!("\n- {whose}**{line}**") } else { format!("\n  - {line}") });
            }
        }
        Some(Ok(text))
    }

    fn run(&mut self, rules: &Rules) -> Result<Rc<Run>, String> {
        let digest = rules.digest();
        if let Some((known, run)) = &self.run
            && *known == digest
        {
            return Ok(Rc::clone(run));
        }
        let log = self.log.as_ref().ok_or("there is no recording")?;
        let run = log.opened().and_then(|opened| Run::new(rules, opened)).map_err(|error| error.to_string())?;
        let run = Rc::new(run);
        self.run = Some((digest, Rc::clone(&run)));
        Ok(run)
    }
}

/// The hands of the recording.
fn sides(inspector: &Inspector) -> impl Iterator<Item = Side> + use<> {
    let sides: Vec<Side> = inspector.frames().layout.hands.iter().map(|hand| hand.side).collect();
    sides.into_iter()
}
