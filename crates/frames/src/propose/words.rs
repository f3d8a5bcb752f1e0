//! The words of column names, and what they stand for in the logs of the field.

use teachtree_base::hands::{Finger, Side};

/// Words for the tool of a robot, the best one first.
const TOOL: [&str; 15] = [
    "tcp", "eef", "ee", "effector", "endpoint", "tool", "gripper", "hand", "palm", "glove", "flange", "wrist", "agent",
    "robot", "limb",
];
/// Names of the flange of an arm and of its last link, which bears the flange; the best one first.
const FLANGES: [&str; 13] = [
    "flange",
    "tool0",
    "ee_link",
    "wrist_3",
    "wrist3",
    "bracelet",
    "link_8",
    "link8",
    "link_7",
    "link7",
    "link_6",
    "link6",
    BROADCASTER,
];
/// The topic of ROS 2 for the tool point that is set in a controller: the flange where none is set.
const BROADCASTER: &str = "tcp_pose_broadcaster";
/// Words for commands to a robot, which are not measurements.
const COMMANDS: [&str; 11] =
    ["action", "actions", "cmd", "command", "commanded", "desired", "setpoint", "reference", "leader", "goal", "next"];
/// Words for quantities of a robot: their targets are commands.
const COMMANDED: [&str; 22] = [
    "pose",
    "poses",
    "position",
    "positions",
    "pos",
    "orientation",
    "q",
    "qd",
    "qdd",
    "joint",
    "joints",
    "velocity",
    "vel",
    "speed",
    "current",
    "wrench",
    "force",
    "torque",
    "moment",
    "effort",
    "width",
    "twist",
];
/// Words before the name of a body that do not name it: the program or the sensor that found it, `object` and `info`.
const SOURCES: [&str; 16] = [
    "perception",
    "vrpn",
    "mocap",
    "vicon",
    "optitrack",
    "qualisys",
    "datagen",
    "info",
    "tracking",
    "tracker",
    "detection",
    "aruco",
    "apriltag",
    "fiducial",
    "fiducials",
    "object",
];
/// Words that say what kind of quantity a column is, or where the log keeps it: they name no body.
const GENERIC: [&str; 62] = [
    "m",
    "mm",
    "cm",
    "deg",
    "rad",
    "obs",
    "observation",
    "observations",
    "state",
    "states",
    "data",
    "pose",
    "poses",
    "position",
    "positions",
    "pos",
    "p",
    "q",
    "quat",
    "quaternion",
    "orientation",
    "rotation",
    "rot",
    "ori",
    "rotvec",
    "rv",
    "rpy",
    "euler",
    "axis",
    "angle",
    "transform",
    "transforms",
    "translation",
    "tf",
    "tf2",
    "static",
    "xyz",
    "wxyz",
    "xyzw",
    "world",
    "actual",
    "current",
    "measured",
    "main",
    "body",
    "bodies",
    "msg",
    "stamped",
    "environment",
    "env",
    "marker",
    "markers",
    "rigid",
    "subj",
    "site",
    "t",
    "r",
    "l",
    "loc",
    "abs",
    "low",
    "dim",
];
/// Markers and links that are parts of a person, of a robot or of the room.
const PARTS: [&str; 24] = [
    "elbow", "shoulder", "back", "head", "neck", "chest", "spine", "pelvis", "hip", "knee", "ankle", "foot", "toe",
    "forearm", "clavicle", "arm", "link", "joint", "base", "camera", "map", "odom", "mount", "torso",
];

/// Words for where a robot begins or ends in a demonstration; a rest may be a stand, such as `tool_rest`.
const ENDS: [&str; 6] = ["demo", "start", "end", "home", "init", "initial"];

/// Words for bodies that carry others.
const SUPPORTS: [&str; 9] = ["table", "tray", "bin", "shelf", "plate", "surface", "ground", "floor", "desk"];

/// The words of a name in lower case: parted at signs, and where a capital follows a small letter.
pub fn words(name: &str) -> Vec<String> {
    let mut all: Vec<String> = vec![];
    for token in tokens(name) {
        if let Some(meaning) = robotiq_name(token) {
            all.extend(meaning.iter().map(ToString::to_string));
            continue;
        }
        let label = marker_label(token);
        let token = match &label {
            Some((side, label)) => {
                all.push(side.to_lowercase().to_string());
                label.as_str()
            }
            None => token,
        };
        let (mut word, mut was_small) = (String::new(), false);
        for letter in token.chars() {
            if letter.is_uppercase() && was_small {
                all.push(std::mem::take(&mut word).to_lowercase());
            }
            was_small = letter.is_lowercase();
            word.push(letter);
        }
        all.push(word.to_lowercase());
    }
    all
}

/// The words for the model of a gripper of Robotiq, and for its register of the measured position.
fn robotiq_name(token: &str) -> Option<&'static [&'static str]> {
    match token.to_lowercase().as_str() {
        "2f85" | "2f140" | "hande" => Some(&["robotiq"]),
        "gpo" => Some(&["robotiq", "position"]),
        _ => None,
    }
}

/// The side and the rest of the label of a marker on a person: `R` and `Thumb` of `RThumb`, `R` and `ThumbTip` of `RTHT`, as the marker sets of Vicon name it.
fn marker_label(token: &str) -> Option<(char, String)> {
    const LABELS: [(&str, &str); 12] = [
        ("THT", "ThumbTip"),
        ("IFT", "IndexTip"),
        ("MFT", "MiddleTip"),
        ("RFT", "RingTip"),
        ("LFT", "LittleTip"),
        ("WRA", "WristA"),
        ("WRB", "WristB"),
        ("FIN", "Hand"),
        ("FRM", "Forearm"),
        ("ELB", "Elbow"),
        ("UPA", "UpperArm"),
        ("SHO", "Shoulder"),
    ];
    let side = token.chars().next().filter(|side| ['L', 'R'].contains(side))?;
    let rest = token.strip_prefix(side)?;
    if let Some((_, label)) = LABELS.iter().find(|(label, _)| *label == rest) {
        return Some((side, (*label).to_string()));
    }
    let mut letters = rest.chars();
    let is_word =
        letters.next().is_some_and(char::is_uppercase) && rest.len() > 2 && letters.take(2).all(char::is_lowercase);
    is_word.then(|| (side, rest.to_string()))
}

/// The parts of a name between signs, as they are written, without the frame of a transform: `T_base_cube` is the pose of `cube`.
fn tokens(name: &str) -> impl Iterator<Item = &str> {
    const FRAMES: [&str; 6] = ["base", "world", "robot", "map", "b", "w"];
    let all: Vec<&str> =
        name.split(|letter: char| !letter.is_alphanumeric()).filter(|token| !token.is_empty()).collect();
    let is_frame = |parts: &[&str]| parts[0] == "T" && FRAMES.contains(&parts[1].to_lowercase().as_str());
    let frame = all.windows(3).position(|parts| is_frame(parts) && !is_quantity(parts[2]));
    let is_named = move |(at, _): &(usize, &str)| frame.is_none_or(|frame| !(frame..frame + 2).contains(at));
    all.into_iter().enumerate().filter(is_named).map(|(_, token)| token)
}

/// Whether a part of a name names no body.
fn is_quantity(token: &str) -> bool {
    GENERIC.contains(&token.to_lowercase().as_str())
}

/// A part of a name without the quantity behind the name of a body: `bottle` of `bottlePos`.
fn without_quantity(token: &str) -> &str {
    const QUANTITIES: [&str; 9] =
        ["Position", "Pose", "Pos", "Quaternion", "Quat", "Rotation", "Rot", "Orientation", "Ori"];
    let own = QUANTITIES.iter().find_map(|quantity| token.strip_suffix(quantity));
    own.filter(|own| own.ends_with(|letter: char| letter.is_lowercase() || letter.is_ascii_digit())).unwrap_or(token)
}

/// Whether one of these words is among others.
pub fn has(words: &[String], known: &[&str]) -> bool {
    words.iter().any(|word| known.contains(&word.as_str()))
}

/// Whether a column is a command.
pub fn is_command(words: &[String]) -> bool {
    // A target may be an object, but not that of a tool or of a quantity.
    has(words, &COMMANDS) || has(words, &["target"]) && (has(words, &TOOL) || has(words, &COMMANDED))
}

/// Whether a column is from one thing to another: no place in the world.
pub fn is_relative(words: &[String]) -> bool {
    has(words, &["to", "rel", "delta", "diff", "error", "offset"])
        || words.iter().any(|word| word.starts_with("relative"))
}

/// Whether a column is how far markers are from their places in a rigid body: `Mean Marker Error`.
pub fn is_marker_error(words: &[String]) -> bool {
    has(words, &["error"]) && has(words, &["marker", "markers"])
}

/// The rank of the best word for a tool, 0 for the best.
pub fn tool_rank(words: &[String]) -> Option<usize> {
    TOOL.iter().position(|tool| {
        words.iter().any(|word| word == tool || word.trim_end_matches(|c: char| c.is_ascii_digit()) == *tool)
    })
}

/// The rank of the name of a flange or of a last link, 0 for the best; none of a tool point in front of it, such as `link6_tcp`.
pub fn flange_rank(words: &[String]) -> Option<usize> {
    let name = format!("_{}_", words.join("_"));
    let is_it = |flange: &&str| {
        name.split_once(&format!("_{flange}_")).is_some_and(|(before, after)| {
            let mut others = before.split('_').chain(after.split('_'));
            !others.any(|word| ["tcp", "eef", "ee", "endpoint"].contains(&word))
        })
    };
    FLANGES.iter().position(is_it)
}

/// Why a name is that of a flange.
pub fn flange_reason(words: &[String]) -> &'static str {
    match words.join("_").contains(BROADCASTER) {
        true => "the tool point of the controller, which is the flange where none is set",
        false => "by its name the flange of the arm",
    }
}

/// Whether a name is that of a thing worn at a hand, which is an object where the hand has a better tool point.
pub fn is_worn(words: &[String]) -> bool {
    words.iter().any(|word| matches!(word.as_str(), "glove" | "bracelet"))
        && side(words).is_none()
        && !has(words, &["link"])
}

/// Whether all words of a name are for a hand or a tool, its side, a place where it begins or ends, or a quantity: no object has this name.
pub fn is_only_tool(words: &[String]) -> bool {
    let is_of = |word: &String| {
        let word = std::slice::from_ref(word);
        tool_rank(word).is_some() || side(word).is_some() || has(word, &GENERIC) || has(word, &ENDS)
    };
    tool_rank(words).is_some() && words.iter().all(is_of)
}

/// Whether a place is a part of a person, of a robot or of the room.
pub fn is_part(words: &[String]) -> bool {
    // The back of a hand is the hand.
    let is_of_hand = |word: &str| word == "back" && has(words, &["hand"]);
    words.iter().any(|word| PARTS.contains(&word.trim_end_matches(|c: char| c.is_ascii_digit())) && !is_of_hand(word))
}

/// Whether the name of a body is that of one that carries others.
pub fn is_support(body: &str) -> bool {
    has(&words(body), &SUPPORTS)
}

/// The hand in a name.
pub fn side(words: &[String]) -> Option<Side> {
    let is_of = |side: &[&str]| has(words, side);
    match () {
        () if is_of(&["l", "left", "robot1", "arm1", "lh", "larm"]) => Some(Side::Left),
        () if is_of(&["r", "right", "robot0", "arm0", "rh", "rarm"]) => Some(Side::Right),
        () => None,
    }
}

/// The finger that a marker between its tip and the palm is on: `little_middle`, `index_pip`.
pub fn joint_of_finger(words: &[String]) -> Option<Finger> {
    const JOINTS: [&str; 11] =
        ["middle", "mid", "knuckle", "base", "root", "proximal", "distal", "pip", "dip", "mcp", "intermediate"];
    finger_of_person(words).filter(|_| words.iter().skip(1).any(|word| JOINTS.contains(&word.as_str())))
}

/// The finger whose word is the first one in a name, and the other words; a ring may be an object.
pub fn of_finger(words: &[String]) -> Option<(Finger, Vec<String>)> {
    const FINGERS: [(&[&str], Finger); 5] = [
        (&["thumb", "thtip", "f1", "finger1", "leftfinger"], Finger::Thumb),
        (&["index", "iftip", "f2", "finger2", "rightfinger"], Finger::Index),
        (&["middle", "mftip", "f3", "finger3"], Finger::Middle),
        (&["ring", "rftip", "f4"], Finger::Ring),
        (&["little", "pinky", "lftip", "f5"], Finger::Little),
    ];
    let named = |word: &String| FINGERS.iter().find(|(known, _)| known.contains(&word.as_str()));
    let (at, finger) = words.iter().enumerate().find_map(|(at, word)| Some((at, named(word)?.1)))?;
    let others = words.iter().enumerate().filter(|(other, _)| *other != at).map(|(_, word)| word.clone());
    Some((finger, others.collect()))
}

fn finger_of_person(words: &[String]) -> Option<Finger> {
    of_finger(words).map(|(finger, _)| finger)
}

/// The finger that a name is of: fingers of a person, or the two of a gripper.
pub fn finger(words: &[String]) -> Option<Finger> {
    // `middle_tip` and `thumb_middle`: the first word counts.
    let named = finger_of_person(words);
    let is_finger = has(words, &["finger", "fingertip", "fingerpad", "pad"]);
    // A ring may be an object.
    let is_tip = is_finger || words.iter().any(|word| word.ends_with("tip")) || has(words, &["thumb", "index"]);
    if let Some(finger) = named.filter(|finger| {
        is_tip
            || words.iter().any(|word| word.starts_with('f'))
            || !matches!(finger, Finger::Middle | Finger::Ring | Finger::Little)
    }) {
        return Some(finger);
    }
    if is_finger { jaw(words) } else { None }
}

/// The finger of a gripper of two: `gripper0_finger_joint1_tip`, `left_finger`, `pad_a`.
pub fn jaw(words: &[String]) -> Option<Finger> {
    match () {
        () if has(words, &["joint1", "left", "l", "1", "a"]) => Some(Finger::Thumb),
        () if has(words, &["joint2", "right", "r", "2", "b"]) => Some(Finger::Index),
        () => None,
    }
}

/// The name of a body: what is left of a name without words for quantities.
pub fn body(name: &str) -> Option<String> {
    named(tokens(name).filter(|token| !is_number(token)))
}

/// The name of a body with the numbers in it: that of one of several.
pub fn numbered_body(name: &str) -> Option<String> {
    named(tokens(name))
}

/// Whether a number stands in a name.
pub fn has_number(name: &str) -> bool {
    tokens(name).any(is_number)
}

fn is_number(token: &str) -> bool {
    token.chars().all(|c| c.is_ascii_digit())
}

fn named<'a>(tokens: impl Iterator<Item = &'a str>) -> Option<String> {
    let left: Vec<&str> = tokens.filter(|token| !is_quantity(token)).map(without_quantity).collect();
    as_name(&left)
}

/// The name of a body without the program or the sensor that found it; `object_a` keeps it.
pub fn without_source(name: &str) -> String {
    let words: Vec<&str> = name.split('_').collect();
    let is_own = |word: &&str| !SOURCES.contains(&word.to_lowercase().as_str());
    let own = words.iter().position(is_own).and_then(|first| words.get(first..));
    own.and_then(as_name).filter(|own| own.len() > 1).unwrap_or_else(|| name.to_string())
}

fn as_name(words: &[&str]) -> Option<String> {
    // Vicon writes the subject and its only segment: `Cup:Cup`.
    let mut words = words.to_vec();
    words.dedup();
    let name = Some(words.join("_")).filter(|text| text.starts_with(|c: char| c.is_alphabetic()))?;
    // These begin the names of other channels.
    let is_taken = ["left", "right", "both", "contact", "time"].contains(&name.to_lowercase().as_str());
    Some(if is_taken { format!("{name}_object") } else { name })
}
