//! Why a grasp is refused, with the sentence that the user reads.

use teachtree_base::hands::Finger;
use teachtree_command::FRICTION;

/// Why no pose of the hand holds the object at the demonstrated contacts.
#[derive(Clone, Debug, PartialEq)]
pub enum NoGrasp {
    /// The hand has no such finger.
    Lacks(Finger),
    /// Of the best pose, the finger that stays farthest from its contact, and how far, m.
    OutOfReach(Finger, f64),
    /// Every finger reaches, but hand, object, obstacles and fingers are not clear of each other: the worst overlap, m, and between whom.
    InTheWay(f64, String),
    /// The arm cannot bring the palm to any pose that was found.
    ArmOutOfReach,
    /// Every finger reaches, but a pad looks away from the surface: by this angle, rad.
    PadTurnedAway(Finger, f64),
    /// Nothing touches against the thumb, or no thumb against what touches: there is nothing to be held between jaws.
    OneSided,
    /// Jaws do not open as far as they must: so far, m, and at most as far.
    TooWide(f64, f64),
    /// Jaws do not close as far as they must: so far, m, and at least as far.
    TooNarrow(f64, f64),
    /// The line between the jaws leans from the surface at one of them by this angle, rad, and friction does not hold it there.
    SlipsOff(Finger, f64),
}

impl std::fmt::Display for NoGrasp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Lacks(finger) => write!(f, "the hand has no {finger} finger"),
            Self::OutOfReach(finger, miss) => {
                write!(f, "{finger} cannot reach its contact: {:.1} mm are missing", miss * 1e3)
            }
            Self::InTheWay(overlap, who) => write!(f, "{who} are in each other's way by {:.1} mm", overlap * 1e3),
            Self::ArmOutOfReach => f.write_str("the arm cannot bring the palm there"),
            Self::PadTurnedAway(finger, angle) => {
                write!(f, "the pad of {finger} looks {:.0} degrees past the surface", angle.to_degrees())
            }
            Self::OneSided => f.write_str(
                "a gripper holds between thumb and fingers, and here only one side touches: it does not push",
            ),
            Self::TooWide(wanted, most) => {
                let [wanted, most] = [wanted, most].map(|opening| opening * 1e3);
                let missing = wanted - most;
                write!(f, "the jaws open to {most:.1} mm, and {wanted:.1} mm are needed: {missing:.1} mm are missing")
            }
            Self::TooNarrow(wanted, least) => {
                let [wanted, least] = [wanted, least].map(|opening| opening * 1e3);
                let over = least - wanted;
                write!(f, "the jaws close to {least:.1} mm, and {wanted:.1} mm are needed: {over:.1} mm remain open")
            }
            Self::SlipsOff(finger, angle) => {
                let [angle, most] = [*angle, FRICTION.atan()].map(|angle| angle.to_degrees().round());
                write!(
                    f,
                    "the {finger} jaw slips off: the line between the jaws leans by {angle} degrees there, and friction holds up to {most}"
                )
            }
        }
    }
}
