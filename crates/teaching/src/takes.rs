//! The recordings of a run, and the results of the robot.

use serde_json::{Value, json};
use std::path::PathBuf;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Role;

/// Rows of a robot's recording between two that are shown.
const SHOWN_EVERY: usize = 20;

/// The result of a robot.
pub struct RobotResult {
    /// The outcome, as text.
    pub text: String,
    /// Whether every task succeeded.
    pub done: bool,
    /// The page with pictures.
    pub page: String,
    /// The recording of the robot.
    pub recording: Recording,
}

/// The recordings of this run.
#[derive(Default)]
pub(super) struct Takes {
    /// Changes with each change.
    pub(super) version: u64,
    pub(super) writing: usize,
    pub(super) list: Vec<Take>,
    pub(super) robot: Option<RobotJob>,
}

/// A recording.
pub(super) struct Take {
    pub(super) file: PathBuf,
    pub(super) seconds: f64,
    /// The tasks in the analysis of the file.
    pub(super) tasks: Vec<String>,
    /// Why it could not be written, or analyzed.
    pub(super) trouble: Option<String>,
    pub(super) is_written: bool,
}

/// The state of the robot on a recording.
pub(super) struct RobotJob {
    pub(super) take: usize,
    pub(super) part: f64,
    /// The result, once it has ended.
    pub(super) result: Option<Result<RobotResult, String>>,
}

impl Takes {
    pub(super) const fn is_writing(&self) -> bool {
        self.writing > 0
    }

    pub(super) fn troubles(&self) -> Vec<String> {
        let trouble = |take: &Take| Some(format!("{}: {}", take.file.display(), take.trouble.as_ref()?));
        self.list.iter().filter_map(trouble).collect()
    }

    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.list.iter().filter(|take| take.is_written).map(|take| take.file.clone()).collect()
    }

    /// Returns the recordings as a message.
    pub(super) fn json(&self) -> Value {
        let takes = self.list.iter().map(|take| {
            let file = take.file.display().to_string();
            json!({ "file": file, "seconds": take.seconds, "tasks": take.tasks, "trouble": take.trouble, "written": take.is_written })
        });
        let robot = self.robot.as_ref().map(|robot| match &robot.result {
            None => json!({ "take": robot.take, "state": "works", "part": robot.part }),
            Some(Err(why)) => json!({ "take": robot.take, "state": "failed", "text": why }),
            Some(Ok(performed)) => {
                json!({ "take": robot.take, "state": "over", "done": performed.done, "text": performed.text })
            }
        });
        json!({ "type": "takes", "writing": self.writing, "takes": takes.collect::<Vec<_>>(), "robot": robot })
    }

    fn performed(&self) -> Option<&RobotResult> {
        self.robot.as_ref()?.result.as_ref()?.as_ref().ok()
    }

    /// Returns the page with pictures of the robot, and its style.
    pub(super) fn page(&self) -> Option<(String, String)> {
        let page = &self.performed()?.page;
        let (before, rest) = page.split_once("<style>")?;
        let (style, after) = rest.split_once("</style>")?;
        // The server's content security policy allows styles from files only.
        Some((format!("{before}<link rel=\"stylesheet\" href=\"robot.css\">{after}"), style.to_string()))
    }

    /// Returns the motion of the robot for the page.
    pub(super) fn replay(&self) -> Option<Value> {
        self.performed().map(|performed| replay(&performed.recording))
    }
}

/// Returns poses of objects and hands, one in `SHOWN_EVERY` rows.
fn replay(recording: &Recording) -> Value {
    let rows: Vec<usize> = (0..recording.time.len()).step_by(SHOWN_EVERY).collect();
    let column = |name: String, row: usize| {
        let value = recording.columns.get(&name).and_then(|column| column.values.get(row)).copied();
        (value.unwrap_or_default() * 1e4).round() / 1e4 + 0.0
    };
    let vector = |name: &str, row: usize| ["x", "y", "z"].map(|part| column(format!("{name}.{part}"), row));
    let pose = |name: &str, row: usize| -> Vec<f64> {
        let turn = ["w", "x", "y", "z"].map(|part| column(format!("{name}.rotation.{part}"), row));
        vector(&format!("{name}.position"), row).into_iter().chain(turn).collect()
    };
    let objects = recording.scene.bodies.iter().filter(|(_, body)| body.role == Role::Object);
    let bodies = objects.map(|(name, _)| {
        let poses: Vec<Vec<f64>> = rows.iter().map(|row| pose(name, *row)).collect();
        (name.clone(), json!(poses))
    });
    let hands = recording.scene.hands.iter().map(|(side, hand)| {
        let tips = |part: &str, row: usize| -> Vec<[f64; 3]> {
            hand.fingers.iter().map(|finger| vector(&format!("{side}.{finger}.{part}"), row)).collect()
        };
        json!({
            "side": side.name(),
            "palm": rows.iter().map(|row| pose(&format!("{side}.palm"), *row)).collect::<Vec<_>>(),
            "tips": rows.iter().map(|row| tips("position", *row)).collect::<Vec<_>>(),
            "forces": rows.iter().map(|row| tips("force", *row)).collect::<Vec<_>>(),
        })
    });
    json!({
        "time": rows.iter().filter_map(|row| recording.time.get(*row)).collect::<Vec<_>>(),
        "bodies": bodies.collect::<serde_json::Map<_, _>>(),
        "hands": hands.collect::<Vec<_>>(),
    })
}
