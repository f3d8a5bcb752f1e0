//! `analyze --mcap`: an analysis for viewers of robot data, as messages of ROS 2 with the stamps of the log, and a layout that shows them; with `--into`
//! among all messages of the log.

use super::Sink;
use crate::cli::{Failure, output};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::Segment;
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_logs::read::formats::mcap::copy::{McapContents, OriginalRecords, files_of};
use teachtree_logs::read::formats::mcap::ros2_message::{self, Pose, Ros2Type};
use teachtree_logs::read::formats::mcap::write::Writer;
use teachtree_logs::read::table::BagClock;
use teachtree_session::{Analysis, FrameValues, Log};
use teachtree_session::{AnalysisInternals, LogInternals};

/// The frame that all poses are in.
const WORLD: &str = "world";
/// Poses are written at most so often, s: a screen shows no more.
const POSES_EVERY_S: f64 = 0.01;

pub(super) const SINK: Sink = Sink {
    check: |args, path, logs| {
        if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("mcap")) {
            let message = "expected a name that ends in .mcap, as viewers do";
            return Err(InputError::new(path.display().to_string(), message));
        }
        if args.into { logs.iter().try_for_each(|log| files_of(log).map(drop)) } else { Ok(()) }
    },
    places: |path| vec![path.into(), layout_of(path)],
    ..Sink::new(["--mcap", "a file for viewers"], |args, path, log, analysis| {
        let into = args.into.then(|| OriginalBag::of(log, analysis.log())).transpose()?;
        let lanes = McapContent::new(analysis, &args.signals(), into)?;
        Ok(Box::new(move |files, inputs| {
            files.add(path, |out| lanes.write(out))?;
            output::add(files, &layout_of(path), &lanes.layout(), inputs)
        }))
    })
};

/// The files among whose messages the analysis is written.
struct OriginalBag {
    survey: McapContents,
    clock: BagClock,
}

impl OriginalBag {
    /// That of a log.
    ///
    /// # Errors
    /// When the log has no files whose messages can be copied, or its stamps are not those of its messages.
    fn of(path: &Path, log: &Log) -> Result<Self, Failure> {
        let survey = McapContents::of(&files_of(path)?)?;
        let Some(clock) = log.opened()?.clock else {
            let message = "its stamps come from a column or a rate of the binding, expected those of its messages";
            let error = InputError::new(path.display().to_string(), message);
            return Err(error.help("leave `time` and `rate` out of the binding").into());
        };
        Ok(Self { survey, clock })
    }
}

/// What is written, apart from when.
struct McapContent {
    into: Option<OriginalBag>,
    /// Topic and type of each channel.
    channels: Vec<(String, Ros2Type)>,
    /// Time, channel and message of what changes now and then, in order of time.
    events: Vec<(f64, u16, Vec<u8>)>,
    /// The frames' times, s, and values of each signal, with its channel.
    time: Vec<f64>,
    signals: Vec<(u16, Vec<f64>)>,
    /// What moves, and what stands still.
    bodies: Vec<BodyPoses>,
    /// Times of the poses, s.
    rows: Vec<f64>,
    /// What is added to all times so that none is before the clock begins, s.
    shift_s: f64,
    metadata: Vec<(&'static str, String)>,
}

/// Something with a pose.
struct BodyPoses {
    name: String,
    /// Positions, m, and rotations, w x y z, of each row; one row for what stands still.
    position: Vec<[f64; 3]>,
    rotation: Vec<[f64; 4]>,
}

impl BodyPoses {
    /// The pose on a row; `None` where it was not measured.
    fn pose(&self, parent: &'static str, row: usize) -> Option<Pose<'_>> {
        let at = |count: usize| row.min(count.saturating_sub(1));
        let position = *self.position.get(at(self.position.len()))?;
        let rotation = *self.rotation.get(at(self.rotation.len()))?;
        let measured = position.iter().chain(&rotation).all(|value| value.is_finite());
        measured.then_some(Pose { parent, child: &self.name, position, rotation })
    }
}

impl McapContent {
    /// Lays out an analysis with the values of signals, alone or among the messages of a file.
    ///
    /// # Errors
    /// When there is no such signal, or the file has one of the topics already.
    fn new(analysis: &Analysis, signals: &[&str], into: Option<OriginalBag>) -> Result<Self, Failure> {
        let found = analysis.found();
        let mut lanes = Self {
            into,
            channels: Vec::new(),
            events: Vec::new(),
            time: Vec::new(),
            signals: Vec::new(),
            bodies: Vec::new(),
            rows: Vec::new(),
            shift_s: 0.0,
            metadata: Vec::new(),
        };
        for track in &found.tracks {
            let names = |of: fn(&Segment) -> String, segments: &[Segment]| -> Vec<(f64, f64, String)> {
                segments.iter().map(|segment| (segment.start_s, segment.end_s, of(segment))).collect()
            };
            let who = track.who;
            lanes.lane(format!("/teachtree/{who}/primitive"), &names(|it| it.primitive.clone(), &track.relabeled));
            let object = |it: &Segment| it.subject.object.clone().unwrap_or_default();
            lanes.lane(format!("/teachtree/{who}/object"), &names(object, &track.relabeled));
            lanes.lane(format!("/teachtree/{who}/raw"), &names(|it| it.primitive.clone(), &track.segments));
            if who.side().is_some() {
                let tasks: Vec<_> = track.tasks.iter().map(|it| (it.start_s, it.end_s, it.task.clone())).collect();
                lanes.lane(format!("/teachtree/{who}/task"), &tasks);
            }
        }
        lanes.events.sort_by(|a, b| a.0.total_cmp(&b.0));
        let table = analysis.frames(signals)?;
        for (name, _, values) in table.columns() {
            match values {
                FrameValues::Numbers(values) if name == "time" => lanes.time = values.to_vec(),
                FrameValues::Numbers(values) if name != "row" => {
                    let channel =
                        lanes.channel(format!("/teachtree/signal/{}", name.replace('.', "/")), Ros2Type::Number);
                    lanes.signals.push((channel, values.to_vec()));
                }
                _ => {}
            }
        }
        lanes.bodies = bodies(&analysis.log().opened()?.recording);
        if lanes.into.is_some() {
            lanes.bodies.iter_mut().for_each(|body| body.name.insert_str(0, "teachtree/"));
        }
        lanes.rows.clone_from(&analysis.log().opened()?.recording.time);
        if !lanes.bodies.is_empty() {
            lanes.channel(lanes.poses_topic().into(), Ros2Type::Poses);
        }
        let meta = analysis.meta();
        let zero = meta.zero_stamp_s;
        lanes.shift_s = zero.max(-found.start_s.min(lanes.rows.first().copied().unwrap_or(0.0)));
        let params: Vec<String> = meta.params.iter().map(|(name, value)| format!("{name}={value}")).collect();
        if let Some(OriginalBag { survey, clock }) = &lanes.into {
            if let Some((topic, _)) = lanes.channels.iter().find(|(topic, _)| survey.has_topic(topic)) {
                let error = InputError::new(&meta.log, format!("has the topic `{topic}` already"));
                return Err(error.help("label the file that it was made of").into());
            }
            // The clock of the file takes the place of the shift.
            lanes.shift_s = zero;
            lanes.metadata.push(("origin_ns", clock.origin_ns.to_string()));
            lanes.metadata.push(("recorded_after_ns", clock.recorded_after_ns.to_string()));
        }
        lanes.metadata.extend([
            ("version", env!("CARGO_PKG_VERSION").to_string()),
            ("log", meta.log.clone()),
            ("rules", meta.rules.join(" ")),
            ("digest", meta.digest.clone()),
            ("params", params.join(" ")),
            ("shift_s", lanes.shift_s.to_string()),
        ]);
        Ok(lanes)
    }

    fn channel(&mut self, topic: String, ty: Ros2Type) -> u16 {
        self.channels.push((topic, ty));
        u16::try_from(self.channels.len() - 1).unwrap_or(u16::MAX)
    }

    /// A lane of texts: each where it begins, and nothing where one ends and no other begins.
    fn lane(&mut self, topic: String, spans: &[(f64, f64, String)]) {
        let channel = self.channel(topic, Ros2Type::Text);
        for (at, (start, end, text)) in spans.iter().enumerate() {
            self.events.push((*start, channel, ros2_message::text(text)));
            let goes_on = spans.get(at + 1).is_some_and(|(next, ..)| *next <= *end);
            if !goes_on {
                self.events.push((*end, channel, ros2_message::text("")));
            }
        }
    }

    /// When a message is, by the clock that the stamps in messages are of, and by the clock of the file.
    fn stamps(&self, time_s: f64) -> (u64, u64) {
        let since_zero = ((time_s + self.shift_s) * 1e9).round();
        let Some(OriginalBag { clock, .. }) = &self.into else {
            return (since_zero.max(0.0) as u64, since_zero.max(0.0) as u64);
        };
        let stamp = clock.origin_ns.saturating_add(since_zero as i64);
        let logged = stamp.saturating_add(clock.recorded_after_ns);
        (u64::try_from(stamp).unwrap_or(0), u64::try_from(logged).unwrap_or(0))
    }

    fn nanoseconds(&self, time_s: f64) -> u64 {
        self.stamps(time_s).1
    }

    /// The topic of the poses, and the frame that they are in. A file that is copied may have those of its own robot.
    fn poses_topic(&self) -> &'static str {
        if self.into.is_some() { "/teachtree/tf" } else { "/tf" }
    }

    fn world(&self) -> &'static str {
        if self.into.is_some() { "teachtree/world" } else { WORLD }
    }

    /// Writes the file.
    fn write(&self, out: &mut dyn Write) -> std::io::Result<()> {
        let poses = (0..).zip(&self.channels).find(|(_, (_, ty))| *ty == Ros2Type::Poses).map(|(id, _)| id);
        let original = match &self.into {
            Some(OriginalBag { survey, .. }) => {
                let original = OriginalRecords::open(survey.clone());
                Some(original.map_err(|error| std::io::Error::other(error.to_string()))?)
            }
            None => None,
        };
        let mut writer = Writer::new(out, &self.channels, original)?;
        let (mut events, mut frames, mut rows) = (0, 0, 0);
        let mut posed = f64::NEG_INFINITY;
        loop {
            let never = f64::INFINITY;
            let event = self.events.get(events).map_or(never, |(time, ..)| *time);
            let has_signals = !self.signals.is_empty();
            let frame = self.time.get(frames).copied().filter(|_| has_signals).unwrap_or(never);
            let row = self.rows.get(rows).copied().filter(|_| poses.is_some()).unwrap_or(never);
            if event <= frame && event <= row {
                let Some((time, channel, message)) = self.events.get(events) else { break };
                writer.message(*channel, self.nanoseconds(*time), message)?;
                events += 1;
            } else if frame <= row {
                for (channel, values) in &self.signals {
                    let value = values.get(frames).copied().unwrap_or(f64::NAN);
                    writer.message(*channel, self.nanoseconds(frame), &ros2_message::number(value))?;
                }
                frames += 1;
            } else {
                // The last one is written always.
                if let Some(channel) =
                    poses.filter(|_| row - posed >= POSES_EVERY_S * 0.999 || rows + 1 == self.rows.len())
                {
                    let (stamp, time) = self.stamps(row);
                    writer.message(channel, time, &ros2_message::poses(stamp, &self.poses(rows)))?;
                    posed = row;
                }
                rows += 1;
            }
        }
        writer.finish(&self.metadata)
    }

    fn poses(&self, row: usize) -> Vec<Pose<'_>> {
        self.bodies.iter().filter_map(|body| body.pose(self.world(), row)).collect()
    }

    /// A layout for Foxglove that shows the lanes, the signals and the poses.
    fn layout(&self) -> String {
        let of = |wanted: Ros2Type| self.channels.iter().filter(move |(_, ty)| *ty == wanted).map(|(topic, _)| topic);
        let path = |topic: &String| {
            json!({ "value": format!("{topic}.data"), "label": topic.trim_start_matches("/teachtree/"), "enabled": true,
                "timestampMethod": "receiveTime" })
        };
        let lanes: Vec<Value> = of(Ros2Type::Text).filter(|topic| !topic.ends_with("/raw")).map(path).collect();
        let signals: Vec<Value> = of(Ros2Type::Number).map(path).collect();
        let mut panels = serde_json::Map::new();
        panels.insert("StateTransitions!teachtree".into(), json!({ "paths": lanes, "isSynced": true }));
        let scene = json!({ "followTf": self.world(), "scene": { "transforms": { "showLabel": true, "axisScale": 0.2 } },
            "topics": { self.poses_topic(): { "visible": true } } });
        panels.insert("3D!teachtree".into(), scene);
        let mut layout = json!({ "first": "3D!teachtree", "second": "StateTransitions!teachtree", "direction": "column",
            "splitPercentage": 60 });
        if !signals.is_empty() {
            let plot = json!({ "paths": signals, "showLegend": true, "isSynced": true, "xAxisVal": "timestamp" });
            panels.insert("Plot!teachtree".into(), plot);
            layout =
                json!({ "first": layout, "second": "Plot!teachtree", "direction": "column", "splitPercentage": 70 });
        }
        let whole = json!({ "configById": panels, "globalVariables": {}, "userNodes": {}, "playbackConfig": { "speed": 1 },
            "layout": layout });
        serde_json::to_string_pretty(&whole).unwrap_or_default() + "\n"
    }
}

/// The bodies and hands of a recording that have a position.
fn bodies(recording: &Recording) -> Vec<BodyPoses> {
    let column =
        |name: &str, part: &str| recording.columns.get(&format!("{name}.{part}")).map(|it| it.values.as_slice());
    let rows = |name: &str, parts: [&str; 3]| -> Option<Vec<[f64; 3]>> {
        let [x, y, z] = parts.map(|part| column(name, part));
        Some(x?.iter().zip(y?).zip(z?).map(|((x, y), z)| [*x, *y, *z]).collect())
    };
    let turned = |name: &str| -> Option<Vec<[f64; 4]>> {
        let vector = rows(name, ["rotation.x", "rotation.y", "rotation.z"])?;
        let w = column(name, "rotation.w")?;
        Some(w.iter().zip(vector).map(|(w, [x, y, z])| [*w, x, y, z]).collect())
    };
    let upright = || vec![[1.0, 0.0, 0.0, 0.0]];
    let moved = |name: &str| rows(name, ["position.x", "position.y", "position.z"]);
    let mut bodies = Vec::new();
    for (name, body) in &recording.scene.bodies {
        let position = moved(name).unwrap_or_else(|| vec![body.position.map(|part| part.0)]);
        let rotation = turned(name).unwrap_or_else(|| vec![body.rotation]);
        bodies.push(BodyPoses { name: name.clone(), position, rotation });
    }
    for title in recording.columns.keys().filter_map(|title| title.strip_suffix(".position.x")) {
        if let Some(position) = moved(title).filter(|_| !recording.scene.bodies.contains_key(title)) {
            bodies.push(BodyPoses { name: title.into(), position, rotation: turned(title).unwrap_or_else(upright) });
        }
    }
    bodies
}

/// Where the layout is: beside the file.
fn layout_of(path: &Path) -> PathBuf {
    path.with_extension("foxglove.json")
}
