//! What kept an object from where it should be: a kind with its extent, when it began, and the hand.

use crate::JointKind;
use std::fmt;
use teachtree_base::hands::{Finger, Side};

/// What kept an object from where it should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// When it began, s of the robot's recording.
    pub time_s: f64,
    /// The hand.
    pub side: Side,
    /// What the hand did then.
    pub primitive: String,
    /// What it was.
    pub why: FailureCause,
}

/// Kinds of causes.
#[derive(Clone, Debug, PartialEq)]
pub enum FailureCause {
    /// A joint is at its limit, and the palm or fingertip that it moves so far from where it should be, m and rad.
    JointAtLimit(String, Option<Finger>, f64, f64),
    /// A motor gives less than it is asked for, by so many N m, or N where it slides.
    TorqueMissing(String, f64, JointKind),
    /// A fingertip has moved so far along the surface that it holds, m.
    ContactSlipped(Finger, f64),
    /// A fingertip that held the object touches it no more.
    ContactLost(Finger),
    /// The object was held, and touches nothing now.
    Dropped,
    /// The hole was not within this distance of where it was expected, m.
    HoleMissed(f64),
    /// The object is off its way for good, by so much in the end, m and rad.
    LeftWay(f64, f64),
}

impl FailureCause {
    /// The name of its kind, as it is written.
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

    /// Whether it is the same as another one but for its extent.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::JointAtLimit(one, ..), Self::JointAtLimit(other, ..))
            | (Self::TorqueMissing(one, ..), Self::TorqueMissing(other, ..)) => one == other,
            (Self::ContactSlipped(one, _), Self::ContactSlipped(other, _))
            | (Self::ContactLost(one), Self::ContactLost(other)) => one == other,
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
        }
    }

    /// Takes over the extent of the same cause where it is larger.
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

/// As a message for the user.
impl fmt::Display for Cause {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "after {:.2} s, {} hand in {}: ", self.time_s, self.side, self.primitive)?;
        match &self.why {
            FailureCause::JointAtLimit(joint, finger, m, rad) => {
                let what = finger.map_or_else(|| "palm".into(), |finger| finger.to_string());
                let turned =
                    if finger.is_none() { format!(" and {:.1} degrees", rad.to_degrees()) } else { String::new() };
                write!(to, "`{joint}` is at its limit, the {what} {:.1} mm{turned} off its way", m * 1e3)
            }
            FailureCause::TorqueMissing(joint, missing, JointKind::Revolute) => {
                write!(to, "`{joint}` lacks {missing:.2} N m of torque")
            }
            FailureCause::TorqueMissing(joint, missing, JointKind::Prismatic) => {
                write!(to, "`{joint}` lacks {missing:.2} N of force")
            }
            FailureCause::ContactSlipped(finger, by) => write!(to, "the {finger} slipped by {:.1} mm", by * 1e3),
            FailureCause::ContactLost(finger) => write!(to, "the {finger} lost its contact"),
            FailureCause::Dropped => write!(to, "the object was dropped"),
            FailureCause::HoleMissed(within) => write!(to, "the hole was not within {:.1} mm", within * 1e3),
            FailureCause::LeftWay(m, rad) => {
                write!(
                    to,
                    "the object left its way, by {:.1} mm and {:.1} degrees in the end",
                    m * 1e3,
                    rad.to_degrees()
                )
            }
        }
    }
}
