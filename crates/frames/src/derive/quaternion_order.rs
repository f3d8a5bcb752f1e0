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

/// An order in which the components may really be that are read as w, x, y, z.
pub struct Order {
    /// The places of w, x, y, z among the components as they are read.
    places: [usize; 4],
    /// What the columns hold.
    columns: &'static str,
    /// The patterns of a binding: for canonical names, for any, and the one that reads them wrongly.
    canonical: &'static str,
    pattern: &'static str,
    instead: &'static str,
}

/// The other orders in use: scalar last that is read as scalar first, and the reverse.
pub const ORDERS: [Order; 2] = [
    Order { places: [3, 0, 1, 2], columns: "x, y, z, w", canonical: "xyzw=w x y z", pattern: "xyzw", instead: "wxyz" },
    Order { places: [1, 2, 3, 0], columns: "z, w, x, y", canonical: "wxyz=x y z w", pattern: "wxyz", instead: "xyzw" },
];

impl Order {
    /// The components w, x, y, z of a quaternion as it is read.
    pub fn of(&self, read: [f64; 4]) -> [f64; 4] {
        self.places.map(|place| read[place])
    }

    /// The condition and the binding that meets it: `the columns that are read as w, x, y, z are …: if they are, write …`.
    pub fn advice(&self, channel: &str) -> String {
        let Self { columns, canonical, pattern, instead, .. } = self;
        format!(
            "the columns that are read as w, x, y, z are {columns}: if they are, write `<{pattern}=…>` instead of `<{instead}=…>` in a binding, or \
             `{channel}: {channel}.<{canonical}>` for columns with canonical names"
        )
    }
}

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
        let by_order = ORDERS.iter().map(|order| (order, off(order.of([a, b, c, d]))));
        let Some((order, by)) = by_order.min_by(|(_, one), (_, other)| one.total_cmp(other)) else { continue };
        if as_read < ELSEWHERE || by > THERE || !stands(measured, name, body, start) {
            continue;
        }
        let message = format!(
            "at the start it differs by {}° from the `rotation` of the scene, and by {}° if {}",
            degrees(as_read),
            degrees(by),
            order.advice(&channel)
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
