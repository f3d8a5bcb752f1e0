//! The options of `teach --live`.

use super::camera::HandFinder;
use super::takes::RobotResult;
use std::path::{Path, PathBuf};
use teachtree_base::scene::Scene;
use teachtree_session::RulesOptions;

/// What is taught, and how.
pub struct Options {
    /// The scene.
    pub scene: Scene,
    /// Its name, to show.
    pub name: String,
    /// Where recordings are written: the first one here, the others with a number.
    pub out: PathBuf,
    /// Files that are not written over.
    pub inputs: Vec<PathBuf>,
    /// The rules that label what is recorded.
    pub rules: RulesOptions,
    /// What finds hands in the pictures of a camera.
    pub camera: Option<HandFinder>,
    /// Lets the robot perform a recording; a sentence where it cannot. The part that is done is reported now and then.
    #[allow(clippy::type_complexity, reason = "it is named nowhere else")]
    pub perform: Box<dyn Fn(&Path, &mut dyn FnMut(f64)) -> Result<RobotResult, String> + Send + Sync>,
}
