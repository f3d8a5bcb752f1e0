//! The reasons for refusing a grasp, and their messages.

use teachtree_base::hands::Finger;
use teachtree_command::FRICTION;

/// The reason why no pose of the hand holds the object at the demonstrated contacts.
#[derive(Clone, Debug, PartialEq)]
pub enum NoGrasp {
    /// The hand has no such finger.
    Lacks(Finger),
    /// The finger that is farthest from its contact at the best pose, and the missing distance, m.
    OutOfReach(Finger, f64),
    /// Every finger reaches its contact, but hand, object, obstacles or fingers overlap: the largest overlap, m, and the pair.
    InTheWay(f64, String),
    /// The arm cannot reach any of the poses.
    ArmOutOfReach,
    /// Every finger reaches its contact, but a pad faces away from the surface by this angle, rad.
    PadTurnedAway(Finger, f64),
    /// The contacts are on one side only, so that jaws have nothing between them.
    OneSided,
    /// The jaws do not open far enough: the required and the largest opening, m.
    TooWide(f64, f64),
    /// The jaws do not close far enough: the required and the smallest opening, m.
    TooNarrow(f64, f64),
    /// The line between the jaws leans from the surface normal at one jaw by this angle, rad, and friction does not hold it there.
    SlipsOff(Finger, f64),
}

impl std::fmt::Display for NoGrasp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Lacks(finger) => write!(f, "the hand has no {finger} finger"),
            Self::OutOfReach(finger, miss) => {
                write!(f, "{finger} cannot reach its contact: {:.1} mm are missing", miss * 1e3)
            }
            Self::InTheWay(overlap, who) => write!(f, "{who} overlap by {:.1} mm", overlap * 1e3),
            Self::ArmOutOfReach => f.write_str("the arm cannot bring the palm there"),
            Self::PadTurnedAway(finger, angle) => {
                write!(f, "the pad of {finger} faces {:.0} degrees away from the surface", angle.to_degrees())
            }
            Self::OneSided => f.write_str(
                "a gripper holds an object between thumb and fingers, and only one side touches it here: grippers do not push",
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
