//! The options of `teach --live`.

use super::camera::HandFinder;
use super::takes::RobotResult;
use std::path::{Path, PathBuf};
use teachtree_base::scene::Scene;
use teachtree_session::RulesOptions;

/// The options of a teaching session.
pub struct Options {
    /// The scene.
    pub scene: Scene,
    /// The displayed name of the scene.
    pub name: String,
    /// The path of the first recording; the paths of the others have a number.
    pub out: PathBuf,
    /// Files that are not overwritten.
    pub inputs: Vec<PathBuf>,
    /// The rules that label recordings.
    pub rules: RulesOptions,
    /// The hand tracker for pictures of a camera.
    pub camera: Option<HandFinder>,
    /// Runs the robot on a recording; returns a message if it cannot. Periodically reports the finished share.
    #[allow(clippy::type_complexity, reason = "it is named nowhere else")]
    pub perform: Box<dyn Fn(&Path, &mut dyn FnMut(f64)) -> Result<RobotResult, String> + Send + Sync>,
}
