//! Quaternions whose columns are in another order than they are read in: where the scene gives the orientation of a body, its first sample decides.
//!
//! A body that is turned by half a turn about an upright axis reads, in another order, as one that is not turned. So the scene has to be
//! about this log: a body that it gives no place, or another place than the log, is not evidence.

use super::motion::vector;
use crate::clean::preprocess::CleanLog;
use nalgebra::Vector3;
use teachtree_base::geometry::unit;
use teachtree_base::scene::Body;
use teachtree_logs::issue::{Issue, IssueKind};

/// A body that is turned by more than this from where the scene has it does not stand as the scene says, rad.
const ELSEWHERE: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// One that is turned by less does, rad.
const THERE: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Maximum distance of a body from its pose in the scene, m.
const AWAY: f64 = 0.100;

/// Returns an issue for rotations that are not as the scene has them at the start, and would be in another order; none when a body of the log is as the
/// scene has it, for a log has one order.
pub fn swapped(measured: &CleanLog) -> Vec<Issue> {
    let start = measured.core().start;
    let mut issues = vec![];
    for (name, body) in &measured.scene.bodies {
        let channel = format!("{name}.rotation");
        let Some(columns) = measured.rotation(&channel) else { continue };
        let [a, b, c, d] = columns.map(|column| column.get(start).copied().unwrap_or_default());
        let off = |read: [f64; 4]| unit(read).angle_to(&unit(body.rotation));
        let as_read = off([a, b, c, d]);
        if as_read < THERE {
            return vec![];
        }
        let xyzw = (off([d, a, b, c]), "x, y, z, w", "xyzw=w x y z", "wxyz");
        let wxyz = (off([b, c, d, a]), "z, w, x, y", "wxyz=x y z w", "xyzw");
        let nearest = if xyzw.0 <= wxyz.0 { xyzw } else { wxyz };
        let (by, hold, said, instead) = nearest;
        if as_read < ELSEWHERE || by > THERE || !stands(measured, name, body, start) {
            continue;
        }
        let order = said.split('=').next().unwrap_or_default();
        let message = format!(
            "at the start it differs by {}° from the `rotation` of the scene, and by {}° if the columns that are read as w, x, y, z are {hold}: if they \
             are, write `<{order}=…>` instead of `<{instead}=…>` in a binding, or `{channel}: {channel}.<{said}>` for columns with canonical names",
            degrees(as_read),
            degrees(by)
        );
        issues.push(measured.over_all(IssueKind::IMPLAUSIBLE_ROTATION, &channel, message));
    }
    issues
}

/// Whole degrees.
fn degrees(angle: f64) -> f64 {
    angle.to_degrees().round()
}

/// Whether the scene says where a body stands, and it stands there at this frame.
fn stands(measured: &CleanLog, name: &str, body: &Body, frame: usize) -> bool {
    let said = Vector3::from(body.position.map(|length| length.0));
    let Some(position) = measured.vec3(&format!("{name}.position")).filter(|_| said != Vector3::zeros()) else {
        return false;
    };
    (vector(&position, frame) - said).norm() < AWAY
}
