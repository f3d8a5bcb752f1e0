//! The rule files that come with the program.

macro_rules! shipped {
    ($($name:literal),+ $(,)?) => {
        /// Name and text of each file of `rules/`.
        pub const SHIPPED: &[(&str, &str)] =
            &[$(($name, include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../rules/", $name)))),+];
    };
}

shipped![
    "stream.rules",
    "single_hand.rules",
    "contact.rules",
    "bimanual.rules",
    "failures.rules",
    "jaws.rules",
    "hand_force.rules",
    "hand_flags.rules",
    "contact_times.rules",
    "wrist_force.rules",
    "hand_wrist.rules",
    "hand_holding.rules",
    "hand_gripper.rules",
    "hand_gripper_pair.rules",
    "hand_gripper_wrist.rules",
    "hand_vision.rules",
    "hand_mechanism.rules",
    // Behind those that declare the same names: these are the ones that a missing `use` means.
    "prompt.rules",
];

/// Former names of shipped files, which rule files and bindings may still use.
const FORMER: [(&str, &str); 4] = [
    ("hand_blind.rules", "contact_times.rules"),
    ("hand_felt.rules", "wrist_force.rules"),
    ("hand_seen.rules", "hand_vision.rules"),
    ("hand_place.rules", "hand_mechanism.rules"),
];

/// The shipped file that is meant by `contact.rules` or `rules/contact.rules`.
pub fn shipped(name: &str) -> Option<(&'static str, &'static str)> {
    let name = name.strip_prefix("rules/").unwrap_or(name);
    let name = FORMER.iter().find(|(former, _)| *former == name).map_or(name, |(_, now)| now);
    SHIPPED.iter().copied().find(|(shipped, _)| *shipped == name)
}
