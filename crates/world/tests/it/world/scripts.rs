//! Operator scripts: what is refused, and how it is said; what one that varies by nothing does.

use super::support::cube_on_base;
use teachtree_world::{self as world, Operator};

const TWO_FINGERS: &str = "{right: {fingers: [thumb, index]}}";

fn script(steps: &str) -> String {
    format!(
        "name: test
grips:
  pinch: {{object: cube, contacts: {{thumb: [0 mm, -60 mm, 0 mm], index: [0 mm, 60 mm, 0 mm]}}}}
  reversed: {{object: cube, contacts: {{middle: [0 mm, -60 mm, 0 mm]}}}}
  nowhere: {{object: sphere, contacts: {{thumb: [0 mm, 0 mm, 0 mm]}}}}
hands:
  right:
    start: {{grip: pinch}}
    steps:
{steps}
"
    )
}

fn refused(steps: &str) -> String {
    let scene = cube_on_base("", TWO_FINGERS);
    let taught =
        Operator::read(&script(steps), "test.operator.yaml").and_then(|operator| world::teach(&scene, &operator, 0));
    taught.err().map(|error| error.to_string()).unwrap()
}

#[test]
fn scripts_that_cannot_be_performed_are_refused() {
    let refusals = [
        "      - {phase: nothing}",
        "      - {hold: 1 s, open: {}}",
        "      - {hold: 20 mm}",
        "      - {hold: 1 s, whistle: {}}",
        "      - {hold: 1 day}",
        "      - {reach: {grip: pinhc}}",
        "      - {reach: {grip: reversed}}",
        "      - {reach: {grip: nowhere}}",
        "      - {reach: {grip: pinch, speed: 0 mm/s}}",
        "      - {close: {force: -1 N}}",
        "      - {carry: {along: [0, 0, 0], distance: 10 mm}}",
        "      - {carry: {along: [1, 0, 0], distance: 10 mm, until: {contact: moon}}}",
    ];
    insta::assert_snapshot!(refusals.map(|steps| format!("{}\n  {}", steps.trim(), refused(steps))).join("\n"));
}

/// A press without a held object never ends: it is given up, also as the last step, and the error names it.
#[test]
fn a_step_that_takes_too_long_is_named() {
    let scene = world::shipped::scene("pick_and_press").unwrap();
    let reach = "{reach: {grip: top, opened: 12 mm, speed: 180 mm/s}}";
    let press = "{press: {toward: [0, 0, -1], force: 1.5 N, time: 900 ms}}";
    for (steps, given_up) in [
        (format!("[{reach}, {press}, {{hold: 200 ms}}]"), vec!["right steps.1"]),
        (format!("[{reach}, {press}]"), vec!["right steps.1"]),
        (format!("[{reach}, {{hold: 200 ms}}]"), vec![]),
    ] {
        let start = "start: {grip: top, opened: 25 mm, offset: [-60 mm, -150 mm, 250 mm]}";
        let grips = "grips: {top: {object: box, contacts: {index: [0 mm, 0 mm, 35 mm]}}}";
        let script = format!("name: test\n{grips}\nhands: {{right: {{{start}, steps: {steps}}}}}\n");
        let operator = Operator::read(&script, "test.operator.yaml").unwrap();
        let recording = world::teach(&scene, &operator, 0).unwrap();
        let events = recording.events.iter().filter(|event| event.kind == "step_left_undone");
        assert_eq!(events.map(|event| event.subjects.join(" ")).collect::<Vec<_>>(), given_up, "{steps}");
    }
}

/// A carry that is to end at a body and ends before it is named, with the body.
#[test]
fn a_contact_that_is_not_met_is_named() {
    let carry = |distance: &str, is_last: bool| {
        let up = "{carry: {along: [0, 0, 1], distance: 50 mm}}";
        let down = format!("{{carry: {{along: [0, 0, -1], distance: {distance}, until: {{contact: base}}}}}}");
        let steps = ["{reach: {grip: pinch, opened: 10 mm}}", "{close: {force: 1 N}}", up, &down, "{hold: 200 ms}"];
        let steps: String =
            steps[..steps.len() - usize::from(is_last)].iter().map(|step| format!("      - {step}\n")).collect();
        let operator = Operator::read(&script(&steps), "test.operator.yaml").unwrap();
        let recording = world::teach(&cube_on_base("", TWO_FINGERS), &operator, 0).unwrap();
        let unmet = recording.events.iter().filter(|event| event.kind == "contact_not_met");
        unmet.map(|event| event.subjects.join(" ")).collect::<Vec<_>>()
    };
    for last in [false, true] {
        assert_eq!(carry("20 mm", last), ["right steps.3 base"]);
        assert_eq!(carry("120 mm", last), [""; 0]);
        // It is felt only after the way is over.
        assert_eq!(carry("51 mm", last), [""; 0]);
    }
}

#[test]
fn hands_and_scripts_must_match() {
    let two = cube_on_base("", "{right: {fingers: [thumb, index]}, left: {fingers: [thumb]}}");
    let none = cube_on_base("", "{left: {fingers: [thumb]}}");
    let operator = Operator::read(&script("      - {hold: 10 ms}"), "test.operator.yaml").unwrap();
    insta::assert_snapshot!(world::teach(&two, &operator, 0).err().unwrap().to_string());
    insta::assert_snapshot!(world::teach(&none, &operator, 0).err().unwrap().to_string());
}

#[test]
fn a_hand_waits_only_for_what_the_other_one_begins() {
    let refused = |step: &str| {
        let operator = Operator::read(&script(&format!("      - {step}")), "test.operator.yaml").unwrap();
        world::teach(&cube_on_base("", TWO_FINGERS), &operator, 0).err().unwrap().to_string()
    };
    let wanted = "waits for the phase `lift` of the other hand, which has none";
    assert!(refused("{wait: lift}").contains(wanted), "{}", refused("{wait: lift}"));
    assert!(refused("{together: {until: lift}}").contains(wanted), "{}", refused("{together: {until: lift}}"));
    let endless = refused("{together: {share: 0.5}}");
    assert!(endless.contains("has a step `together` without an end, expected one of `until` and `time`"), "{endless}");
}

#[test]
fn unknown_demonstrations_are_named() {
    insta::assert_snapshot!(world::scene("paper_bag").err().unwrap().to_string());
    for name in world::shipped::names() {
        assert!(world::scene(name).is_ok() && world::operator(name).is_ok(), "{name}");
    }
}

#[test]
fn an_operator_without_variation_is_a_machine() {
    let scene = cube_on_base("", TWO_FINGERS);
    let steps = "      - {reach: {grip: pinch, opened: 10 mm}}
      - {close: {force: 1 N}}
      - {hold: 1 s}
      - {carry: {along: [0, 0, 1], distance: 50 mm}}
      - {hold: 500 ms}";
    let operator = Operator::read(&script(steps), "test.operator.yaml").unwrap();
    let (first, second) = (world::teach(&scene, &operator, 1).unwrap(), world::teach(&scene, &operator, 2).unwrap());
    assert_eq!(first, second, "the seed changes nothing");
    let height = first.columns["cube.position.z"].values.last().unwrap();
    // The springs of two fingers give by 0.49 N / 2 / (210 N/m).
    assert!((height - 0.06 - 0.05 + 0.49 / 2.0 / 210.0).abs() < 5e-4, "lifted to {height} m");
    let squeeze = first.columns["right.thumb.force.y"].values.last().unwrap();
    assert!((squeeze - 1.0).abs() < 0.05, "squeezed by {squeeze} N");
    assert_eq!(first.labels["right.label"].last().map(String::as_str), Some("Translate"));
}
