//! `--task-spec`: the specification of a task for programs that generate data. The parts of a demonstration end by its signals, one after the other;
//! each part names the body that its motion is relative to: the partner of what is done, such as the peg of an insertion, else the object.

mod auto_data;
mod mimicgen;

use super::super::output;
use super::Args;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_analysis::Analysis;
use teachtree_analysis::steps::SignalError;
use teachtree_base::error::InputError;
use teachtree_base::hands::{Side, TrackId};
use teachtree_base::meaning::Meaning;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_session::signals::Signal;

/// How many rows after an end a part may be cut, as MimicGen's templates have it.
const OFFSETS: [usize; 2] = [10, 20];

/// The table of formats.
static FORMATS: [Format; 2] = [mimicgen::FORMAT, auto_data::FORMAT];

/// A format of specifications.
struct Format {
    /// The program that reads it.
    program: &'static str,
    /// How files end, the usual ending first.
    endings: &'static [&'static str],
    /// The text of a specification, from the parts of each hand.
    text: fn(&TaskSpec, &Hands, &[Demonstration]) -> Result<String, InputError>,
}

/// The parts of each hand, in their order.
type Hands<'a> = BTreeMap<Side, Vec<&'a Part<'a>>>;

/// A demonstration, and the row of each signal.
pub(super) struct Demonstration<'a> {
    pub name: &'a str,
    pub analysis: &'a Analysis,
    pub rows: &'a [Result<usize, SignalError>],
}

/// A specification that is to be written.
pub(super) struct TaskSpec<'a> {
    args: &'a Args,
    path: PathBuf,
    format: &'static Format,
    wanted: &'a [Signal],
    /// The bodies that the file has poses of; none where it says nothing about them.
    bodies: Vec<String>,
}

/// A part of a demonstration.
struct Part<'a> {
    /// The place of its signal among all.
    at: usize,
    signal: &'a Signal,
    hand: Side,
    object_ref: String,
}

impl<'a> TaskSpec<'a> {
    /// Before any work: the format by the name of the file, and what the data set calls bodies.
    ///
    /// # Errors
    /// When the file cannot be of a specification, or no signal ends a part.
    pub fn new(args: &'a Args, path: &Path, wanted: &'a [Signal]) -> Result<Self, InputError> {
        let place = path.display().to_string();
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let format = FORMATS.iter().find(|format| format.endings.contains(&ending.as_str())).ok_or_else(|| {
            let known =
                FORMATS.iter().map(|Format { program, endings, .. }| format!("`.{}` for {program}", endings[0]));
            let known = known.collect::<Vec<_>>().join(" or ");
            InputError::new(&place, format!("ends in `.{ending}`, expected {known}"))
        })?;
        if wanted.iter().all(|signal| signal.starts) {
            return Err(InputError::new(place, "no signal ends a part of the task, expected at least one")
                .help("name one: --signal grasp='start of Grasp of cube'"));
        }
        output::refuse_inputs(path, &args.analysis.inputs(std::slice::from_ref(&args.data)))?;
        output::refuse_one_for_two(&[path, &args.out])?;
        if path.symlink_metadata().is_ok() {
            let error = InputError::new(place, "exists already, expected the name of a new file");
            return Err(error.help("name another one, or delete it first: its edits would be lost"));
        }
        super::folder_above(path)?;
        Ok(Self { args, path: path.into(), format, wanted, bodies: formats::hdf5::annotate::bodies(&args.data)? })
    }

    /// Adds the file to those that are written together.
    ///
    /// # Errors
    /// As [`text`](Self::text), and when the file cannot be written.
    pub fn add(&self, files: &mut Files, found: &[Demonstration]) -> Result<(), InputError> {
        output::add(files, &self.path, &self.text(found)?, std::slice::from_ref(&self.args.data))
    }

    /// The specification.
    ///
    /// # Errors
    /// When what a part is relative to is not known, or no demonstration has the signals in this order.
    fn text(&self, found: &[Demonstration]) -> Result<String, InputError> {
        let ends = self.wanted.iter().enumerate().filter(|(_, signal)| !signal.starts);
        let parts = ends.map(|(at, signal)| self.part(at, signal, found)).collect::<Result<Vec<_>, _>>()?;
        let mut hands = Hands::new();
        for part in &parts {
            hands.entry(part.hand).or_default().push(part);
        }
        (self.format.text)(self, &hands, found)
    }

    /// What is written of each part of one hand.
    fn subtasks(&self, parts: &[&Part], found: &[Demonstration]) -> Result<Vec<Map<String, Value>>, InputError> {
        let gaps = self.gaps(parts, found)?;
        let mut subtasks = vec![];
        // From the last part on: how early each may be cut limits how late the one before may be.
        let mut next_first = 0;
        for (part, gap) in parts.iter().zip(&gaps).rev() {
            let is_last = subtasks.is_empty();
            let last = gap.saturating_add(next_first).saturating_sub(1).min(OFFSETS[1]);
            let range = [OFFSETS[0].min(last / 2), last];
            next_first = if is_last { 0 } else { range[0] };
            let mut subtask = Map::new();
            let mut put = |key: &str, value: Value| subtask.insert(key.into(), value);
            put("object_ref", json!(part.object_ref));
            put("subtask_term_signal", if is_last { Value::Null } else { json!(part.signal.name) });
            put("subtask_term_offset_range", if is_last { Value::Null } else { json!(range) });
            put("selection_strategy", json!("nearest_neighbor_object"));
            put("selection_strategy_kwargs", json!({ "nn_k": 3 }));
            put("action_noise", json!(0.05));
            put("num_interpolation_steps", json!(5));
            put("num_fixed_steps", json!(0));
            put("apply_noise_during_interpolation", json!(false));
            subtasks.push(subtask);
        }
        subtasks.reverse();
        Ok(subtasks)
    }

    /// The fewest rows from the end of each part to that of the next one, in the demonstrations that have all signals in this order. The last part ends
    /// with the demonstration.
    fn gaps(&self, parts: &[&Part], found: &[Demonstration]) -> Result<Vec<usize>, InputError> {
        let mut gaps = vec![usize::MAX; parts.len()];
        let (mut in_order, mut wrong) = (0, None);
        for Demonstration { name, analysis, rows } in found {
            let ends: Option<Vec<usize>> = parts.iter().map(|part| rows.get(part.at)?.as_ref().ok().copied()).collect();
            let Some(mut ends) = ends else { continue };
            if let Some(last) = ends.last_mut() {
                *last = analysis.rows;
            }
            if let Some(at) = ends.windows(2).position(|pair| !pair.is_sorted_by(|a, b| a < b)) {
                let name_of = |at: usize| parts.get(at).map_or("", |part| part.signal.name.as_str());
                wrong.get_or_insert_with(|| {
                    format!("`{}` does not rise before `{}` in {name}", name_of(at), name_of(at + 1))
                });
                continue;
            }
            in_order += 1;
            for (gap, pair) in gaps.iter_mut().zip(ends.windows(2)) {
                let [end, next] = pair else { continue };
                *gap = (*gap).min(next - end);
            }
        }
        if in_order > 0 {
            return Ok(gaps);
        }
        let (why, help) = match wrong {
            Some(why) => (why, "name the signals in the order in which the parts end"),
            None => (
                "none has all of them".into(),
                "leave out the signals that they lack: without --task-spec, `annotate` lists them",
            ),
        };
        let message = format!("no demonstration has the signals one after the other: {why}");
        Err(self.wrong(message).help(help))
    }

    /// A part, with the body that it is relative to as most demonstrations have it.
    fn part(&self, at: usize, signal: &'a Signal, found: &[Demonstration]) -> Result<Part<'a>, InputError> {
        let subject = &signal.step.subject;
        // A hand that reaches for an object or closes around it moves relative to the object, also if the object is in or on another one.
        let name = signal.step.name.split('(').next().unwrap_or_default();
        let of_object = found.first().and_then(|one| one.analysis.primitives.does(name));
        let of_object = matches!(of_object, Some(Meaning::Approach | Meaning::Close));
        let (mut bodies, mut hands): (BTreeMap<&str, usize>, BTreeMap<Side, usize>) = Default::default();
        for demonstration in found {
            for (who, of, _) in signal.step.spans(demonstration.analysis) {
                if let TrackId::Hand(side) = who {
                    *hands.entry(side).or_default() += 1;
                }
                let partner = of.partner.as_ref().filter(|_| !of_object);
                if let Some(body) = partner.or(of.object.as_ref()) {
                    *bodies.entry(body).or_default() += 1;
                }
            }
        }
        let named = subject.partner.as_deref().filter(|_| !of_object);
        let most = bodies.iter().max_by_key(|(_, count)| **count).map(|(body, _)| *body);
        let body = named.or(most).or(subject.object.as_deref()).ok_or_else(|| {
            let message = format!("signal `{}`: the body that its motion is relative to is not known", signal.name);
            self.wrong(message).help("name it: `of OBJECT`, or `of OBJECT into PARTNER`")
        })?;
        let given = self.args.hdf5.object_ref.iter().find(|(of, _)| of == body).map(|(_, name)| name.as_str());
        let object_ref = given.unwrap_or(body).to_string();
        if !self.bodies.is_empty() && !self.bodies.contains(&object_ref) {
            let message = format!("signal `{}`: the file has no poses of `{object_ref}`", signal.name);
            let names = self.bodies.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            return Err(self.wrong(message).help(format!("it has {names}; name one: --object-ref {body}=NAME")));
        }
        let hand = hands.into_iter().max_by_key(|(_, count)| *count).map_or(Side::Right, |(side, _)| side);
        Ok(Part { at, signal, hand, object_ref })
    }

    fn wrong(&self, message: String) -> InputError {
        InputError::new(self.path.display().to_string(), message)
    }
}
