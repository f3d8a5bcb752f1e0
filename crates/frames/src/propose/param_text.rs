//! Params of the rules that a log shows, for the binding and for the project file.

use super::empty_grippers::Widths;
use super::rounded_yaml::plain;
use super::{ProjectParams, Survey};

/// The most params of a binding.
const MOST: usize = 3;

/// The line of the binding with its params; empty if there are none.
pub fn params(survey: &Survey) -> String {
    let grippers = || survey.grippers.values();
    let reaches: Option<Vec<f64>> = grippers().map(|gripper| gripper.reach_m).collect();
    let reach_m = reaches.and_then(|reaches| reaches.into_iter().reduce(f64::max));
    // One value is for all grippers. Rules that read contacts of fingers have no such param.
    let holds_more = |shut_m: &f64| survey.widths.values().all(|widths| widths.held_m > *shut_m);
    let shut_m = survey.widths.values().filter_map(Widths::shut_m).reduce(f64::max).filter(holds_more);
    let shut_m = shut_m.filter(|_| survey.contacts.lines.is_empty());
    let reach = reach_m.map(|reach_m| {
        let value = format!("grip_reach: {} mm", (reach_m * 1e3).round());
        (value, "fingers farther from an object hold nothing: a relaxed hand is narrow too".to_string())
    });
    let shut = shut_m.map(|shut_m| {
        let value = format!("shut: {} mm", (shut_m * 1e4).round() / 10.0);
        (
            value,
            "a narrower gripper is empty: it rests at this width only at the beginning and the end of the log"
                .to_string(),
        )
    });
    let approach_s = survey.approach_s.filter(|_| survey.contacts.lines.is_empty());
    let approach = approach_s.map(|approach_s| {
        let value = format!("approach_time: {} s", (approach_s * 10.0).round().clamp(2.0, 100.0) / 10.0);
        let time = if approach_s > 10.0 { "for 10 s or longer" } else { "for this time" };
        let reason =
            format!("the tool is near the place of a grasp {time} before; the log has no position of the object");
        (value, format!("{reason}; `live` waits for this time"))
    });
    let retreat_s = survey.retreat_s.filter(|_| survey.contacts.lines.is_empty());
    let retreat = retreat_s.map(|retreat_s| {
        let value = format!("retreat_time: {} s", (retreat_s * 10.0).round().clamp(1.0, 10.0) / 10.0);
        let time = if retreat_s > 1.0 { "for 1 s or longer" } else { "for this time" };
        (value, format!("the tool is near the place of a release {time} after it"))
    });
    let turns_it = survey.hold_points.values().any(|hold| hold.turns_it);
    let again = turns_it.then(|| {
        let reason =
            "a hand that turns an object, leaves it and comes back has not missed it; `live` waits for this time";
        ("miss_again: 5 s".to_string(), reason.to_string())
    });
    let (values, reasons): (Vec<String>, Vec<String>) =
        reach.into_iter().chain(shut).chain(approach).chain(again).chain(retreat).take(MOST).unzip();
    if values.is_empty() {
        return String::new();
    }
    format!("params: {{{}}}    # {}\n", values.join(", "), reasons.join("; "))
}

/// Params for the project file: a binding has room for few.
pub fn project_params(survey: &Survey) -> ProjectParams {
    /// `meet_near` of the rules, m, and its largest value.
    const NEAR_M: f64 = 0.04;
    const MOST_M: f64 = 0.15;
    /// `meet_far` is larger by this, m.
    const MARGIN_M: f64 = 0.02;
    let Some(apart_m) = survey.handed_over_m.filter(|_| survey.is_pair()) else { return ProjectParams::default() };
    let near_m = ((apart_m + MARGIN_M) * 100.0).round() / 100.0;
    if near_m <= NEAR_M || near_m > MOST_M {
        return ProjectParams::default();
    }
    let value = |length_m: f64| format!("{} mm", plain(length_m * 1e3));
    ProjectParams {
        values: vec![("meet_near".into(), value(near_m)), ("meet_far".into(), value(near_m + MARGIN_M))],
        reason: format!("the grippers are {} apart when one takes over what the other holds", value(apart_m)),
    }
}
