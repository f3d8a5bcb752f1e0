//! The start posture of a robot, as `ros2 topic echo --once /joint_states` prints it.

use serde::Deserialize;
use teachtree_base::error::InputError;
use teachtree_base::yaml;

/// The positions of joints: the fields of `sensor_msgs/JointState` that are read.
#[derive(Clone, Debug, Deserialize)]
pub struct Posture {
    /// The joints.
    name: Vec<String>,
    /// Their positions, rad or m.
    position: Vec<f64>,
}

impl Posture {
    /// Reads a posture; `file` is its name in errors.
    ///
    /// # Errors
    /// The text is not a posture.
    pub fn read(text: &str, file: &str) -> Result<Self, InputError> {
        // A printed message ends with the beginning of the next document.
        let first = text.trim_start_matches("---\n").split("\n---").next().unwrap_or(text);
        let read: Self = yaml::read(first, file)?;
        if read.name.len() != read.position.len() {
            let (names, positions) = (read.name.len(), read.position.len());
            return Err(InputError::new(
                file,
                format!("has {names} names and {positions} positions, expected as many"),
            ));
        }
        match read.name.iter().zip(&read.position).find(|(_, position)| !position.is_finite()) {
            Some((name, _)) => Err(InputError::new(file, format!("has no finite position of `{name}`"))),
            None => Ok(read),
        }
    }

    /// Returns the positions of these joints, in their order.
    pub(super) fn of(&self, joints: &[String]) -> Result<Vec<f64>, InputError> {
        let position = |joint: &String| {
            let at = self.name.iter().position(|name| name == joint);
            let lacks = || InputError::new("the present posture", format!("has no position of the joint `{joint}`"));
            at.and_then(|at| self.position.get(at)).copied().ok_or_else(lacks)
        };
        joints.iter().map(position).collect()
    }
}
