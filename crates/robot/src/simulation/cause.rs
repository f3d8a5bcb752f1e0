//! A cause of a failed task: its kind with its extent, its time, and the hand.

use crate::JointKind;
use std::fmt;
use teachtree_base::hands::{Finger, Side};

/// A cause of a failed task.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// The time at which it began, s of the robot's recording.
    pub time_s: f64,
    /// The hand.
    pub side: Side,
    /// The primitive of the hand at that time.
    pub primitive: String,
    /// The kind of the cause.
    pub why: FailureCause,
    /// The place of the cause.
    pub place: CausePlace,
}

/// The place of a cause.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CausePlace {
    /// The link with the fingertip, or the link that the joint moves. `None` if the cause concerns only the object.
    pub link: Option<String>,
    /// The body that the link touches or should touch. For an object, the body with the largest contact force.
    pub contact: Option<String>,
}

/// Kinds of causes.
#[derive(Clone, Debug, PartialEq)]
pub enum FailureCause {
    /// A joint is at its limit; the pose errors of the palm or fingertip that it moves, m and rad.
    JointAtLimit(String, Option<Finger>, f64, f64),
    /// A motor gives less than the commanded torque; the shortfall, N m (N for a prismatic joint).
    TorqueMissing(String, f64, JointKind),
    /// A fingertip has slipped along the held surface by this distance, m.
    ContactSlipped(Finger, f64),
    /// A fingertip that held the object has lost contact.
    ContactLost(Finger),
    /// The object was held and now has no contact.
    Dropped,
    /// The search found no hole within this distance of the expected position, m.
    HoleMissed(f64),
    /// The object left its path and did not return; the final errors, m and rad.
    LeftWay(f64, f64),
}

impl FailureCause {
    /// Returns the name of the kind in text and JSON.
    pub fn name(&self) -> &'static str {
        match self {
            Self::JointAtLimit(..) => "joint_at_limit",
            Self::TorqueMissing(..) => "torque_missing",
            Self::ContactSlipped(..) => "contact_slipped",
            Self::ContactLost(_) => "contact_lost",
            Self::Dropped => "dropped",
            Self::HoleMissed(_) => "hole_missed",
            Self::LeftWay(..) => "left_way",
        }
    }

    /// Whether two causes differ at most in their extent.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::JointAtLimit(one, ..), Self::JointAtLimit(other, ..))
            | (Self::TorqueMissing(one, ..), Self::TorqueMissing(other, ..)) => one == other,
            (Self::ContactSlipped(one, _), Self::ContactSlipped(other, _))
            | (Self::ContactLost(one), Self::ContactLost(other)) => one == other,
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
        }
    }

    /// Raises the extent to that of an equal cause, if it is larger.
    pub(super) fn worsen(&mut self, by: &Self) {
        match (self, by) {
            (Self::JointAtLimit(.., m, rad), Self::JointAtLimit(.., by_m, by_rad)) => {
                (*m, *rad) = (m.max(*by_m), rad.max(*by_rad));
            }
            (Self::TorqueMissing(_, most, _), Self::TorqueMissing(_, now, _))
            | (Self::ContactSlipped(_, most), Self::ContactSlipped(_, now)) => *most = most.max(*now),
            (Self::LeftWay(m, rad), Self::LeftWay(by_m, by_rad)) => (*m, *rad) = (*by_m, *by_rad),
            _ => {}
        }
    }
}

/// Formats the cause as a message.
impl fmt::Display for Cause {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { time_s, side, primitive, why, place } = self;
        write!(to, "after {time_s:.2} s, {side} hand in {primitive}: {why}{place}")
    }
}

impl fmt::Display for CausePlace {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.link, &self.contact) {
            (Some(link), Some(contact)) => write!(to, "; link `{link}`, contact with `{contact}`"),
            (Some(link), None) => write!(to, "; link `{link}`"),
            (None, Some(contact)) => write!(to, "; contact with `{contact}`"),
            (None, None) => Ok(()),
        }
    }
}

impl fmt::Display for FailureCause {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointAtLimit(joint, finger, m, rad) => {
                let what = finger.map_or_else(|| "palm".into(), |finger| finger.to_string());
                let turned =
                    if finger.is_none() { format!(" and {:.1} degrees", rad.to_degrees()) } else { String::new() };
                write!(to, "`{joint}` is at its limit, the {what} {:.1} mm{turned} off its path", m * 1e3)
            }
            Self::TorqueMissing(joint, missing, JointKind::Revolute) => {
                write!(to, "`{joint}` lacks {missing:.2} N m of torque")
            }
            Self::TorqueMissing(joint, missing, JointKind::Prismatic) => {
                write!(to, "`{joint}` lacks {missing:.2} N of force")
            }
            Self::ContactSlipped(finger, by) => write!(to, "the {finger} slipped by {:.1} mm", by * 1e3),
            Self::ContactLost(finger) => write!(to, "the {finger} lost its contact"),
            Self::Dropped => write!(to, "the object was dropped"),
            Self::HoleMissed(within) => write!(to, "the hole was not found within {:.1} mm", within * 1e3),
            Self::LeftWay(m, rad) => {
                write!(
                    to,
                    "the object left its path, by {:.1} mm and {:.1} degrees in the end",
                    m * 1e3,
                    rad.to_degrees()
                )
            }
        }
    }
}
