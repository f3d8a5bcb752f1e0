//! Faults of logs that are being made: what is reported of them, and that labels go on.

use crate::live_log::{Rows, demonstration, events, whole, without_contacts};
use std::collections::BTreeMap;
use teachtree::{Calibration, ErrorKind, Live, LiveEvent, Rules, Scene, TrackId};

fn learned(rows: &Rows) -> (Rules, Calibration) {
    let log = rows.log();
    let rules = Rules::for_log(&log).unwrap();
    let calibration = Calibration::of_whole(&log, &rules).unwrap();
    (rules, calibration)
}

/// The rows of a demonstration at 50 Hz, so that a minute has few.
fn slow(name: &str) -> Rows {
    let mut rows = Rows::of(&demonstration(name));
    let every = (0.02 / (rows.rows[1][0] - rows.rows[0][0])).round() as usize;
    rows.rows = rows.rows.into_iter().step_by(every).collect();
    rows
}

/// Rows that last for some seconds longer from a row on, in which nothing moves and forces are noisy.
fn held(rows: &mut Rows, at: usize, secs: f64) {
    let step = rows.rows[1][0] - rows.rows[0][0];
    let count = (secs / step).round() as usize;
    let mut row = rows.rows[at].clone();
    let from = row[0];
    rows.rows[at + 1..].iter_mut().for_each(|row| row[0] += count as f64 * step);
    let more: Vec<Vec<f64>> = (1..=count)
        .map(|step_at| {
            row[0] = from + step_at as f64 * step;
            // A sequence that fills an interval evenly.
            let noise = |column: usize| {
                0.01 * (2.0 * ((step_at * 31 + column * 7) as f64 * 0.618_033_988_749_894_9).fract() - 1.0)
            };
            let mut noisy = row.clone();
            for column in (0..row.len()).filter(|column| rows.titles[*column].contains(".force.")) {
                noisy[column] += noise(column);
            }
            noisy
        })
        .collect();
    rows.rows.splice(at + 1..at + 1, more);
}

fn issues<'a>(events: impl IntoIterator<Item = &'a LiveEvent>) -> Vec<String> {
    events.into_iter().filter_map(|event| event.issue().map(|_| event.to_string())).collect()
}

/// Rows that are missing, late, repeated or not measured: each is an issue, and what follows is labeled.
#[test]
fn faults_of_rows_are_reported() {
    let mut rows = Rows::of(&demonstration("pick_and_place"));
    let (rules, calibration) = learned(&rows);
    // Some late rows are one issue.
    let late: Vec<Vec<f64>> = rows.rows[200..204].iter().rev().cloned().collect();
    rows.rows.splice(210..210, late);
    rows.rows[300][3] = f64::NAN;
    rows.rows.drain(400..402);
    rows.rows.drain(1000..1300);
    let [before, after] = events(&rows, &rules, &calibration);
    insta::assert_snapshot!(issues(before.iter().chain(&after)).join("\n"));
    assert!(after.iter().any(|event| event.task().is_some_and(|task| task.is_cut_at_start())));
}

/// A sensor that fails ends the stretch while it fails, not when it works again.
#[test]
fn a_value_that_is_not_measured_for_long_ends_the_stretch_at_once() {
    let mut rows = Rows::of(&demonstration("pick_and_place"));
    let (rules, calibration) = learned(&rows);
    rows.rows[2000..2200].iter_mut().for_each(|row| row[3] = f64::NAN);
    let mut live = Live::new(&rules, &rows.titles, &rows.scene, &calibration).unwrap();
    let mut told = vec![];
    for (at, row) in rows.rows.iter().enumerate() {
        told.extend(live.push(row).unwrap().into_iter().map(|event| (at, event)));
    }
    let end: Vec<&(usize, LiveEvent)> = told.iter().filter(|(at, _)| (2000..2200).contains(at)).collect();
    let (at, issue) = end.iter().find(|(_, event)| event.issue().is_some()).unwrap();
    assert!((2019..2023).contains(at), "{at}");
    assert_eq!(issue.issue().unwrap().kind, "not_a_number");
    assert!(end.iter().any(|(_, event)| event.segment().is_some() && event.is_final()));
    assert_eq!(told.iter().filter(|(_, event)| event.issue().is_some()).count(), 1);
}

#[test]
fn a_clock_that_is_set_back_restarts_the_log() {
    let mut rows = Rows::of(&demonstration("pick_and_place"));
    let (rules, calibration) = learned(&rows);
    rows.rows[500..].iter_mut().for_each(|row| row[0] -= 0.4);
    let [before, after] = events(&rows, &rules, &calibration);
    insta::assert_snapshot!(issues(before.iter().chain(&after)).join("\n"));
    assert!(before.iter().chain(&after).any(|event| event.is_final() && event.task().is_some()));
}

#[test]
fn steps_that_are_not_those_of_the_calibration_are_reported_once() {
    let mut rows = Rows::of(&demonstration("pick_and_place"));
    let (rules, calibration) = learned(&rows);
    let step = rows.rows[1][0] - rows.rows[0][0];
    rows.rows.iter_mut().enumerate().skip(100).for_each(|(at, row)| row[0] -= (at - 100) as f64 * step / 2.0);
    let [before, after] = events(&rows, &rules, &calibration);
    insta::assert_snapshot!(issues(before.iter().chain(&after)).join("\n"));
}

/// Bodies that did not touch in the beginning, from which the calibration is, touch later.
#[test]
fn what_touches_first_after_the_calibration_touches() {
    let rows = without_contacts("pick_and_press");
    let log = rows.log();
    let rules = Rules::for_log(&log).unwrap();
    let beginning = Rows { rows: rows.rows[..1000].to_vec(), ..rows.clone() };
    let names = |calibration: &Calibration| -> Vec<String> {
        let [before, after] = events(&rows, &rules, calibration);
        let segments = before.iter().chain(&after).filter(|event| event.is_final()).filter_map(LiveEvent::segment);
        segments.map(|segment| format!("{} {:?}", segment.primitive(), segment.partner())).collect()
    };
    let of_beginning = names(&Calibration::of(&beginning.log(), &rules).unwrap());
    let of_whole = names(&Calibration::of_whole(&log, &rules).unwrap());
    assert_eq!(of_beginning, of_whole);
    let analysis = rules.analyze(&log).unwrap();
    assert!(of_whole.len() > 5 && !whole(&analysis).is_empty());
}

#[test]
fn a_calibration_of_other_bodies_is_refused() {
    let rows = without_contacts("pick_and_press");
    let (rules, calibration) = learned(&rows);
    let other = Rows::of(&demonstration("several_tasks")).scene;
    let refused = Live::new(&rules, &rows.titles, &other, &calibration).err().unwrap();
    assert_eq!(refused.kind(), ErrorKind::Mismatch);
    insta::assert_snapshot!(refused);
    // Of contacts that the log has, nothing is learned.
    let rows = Rows::of(&demonstration("pick_and_press"));
    let (rules, calibration) = learned(&rows);
    let renamed = serde_json::to_string(&demonstration("pick_and_press").scene).unwrap();
    let renamed = Scene::parse("scene", &renamed).unwrap();
    assert!(Live::new(&rules, &rows.titles, &renamed, &calibration).is_ok());
}

/// Hands that rest for longer than anything is kept.
#[test]
fn a_long_rest_is_forgotten_as_it_lasts() {
    let mut rows = slow("pick_and_place");
    held(&mut rows, 5, 700.0);
    let (rules, calibration) = learned(&rows);
    let [before, after] = events(&rows, &rules, &calibration);
    assert_eq!(issues(before.iter().chain(&after)), Vec::<String>::new());
    let analysis = rules.analyze(&rows.log()).unwrap();
    assert_eq!(crate::live_log::reported(before.iter().chain(&after)), whole(&analysis));
}

/// What lasts for longer than anything is kept is cut in two: no time is without a final segment, and none has two.
#[test]
fn what_lasts_too_long_is_final_in_parts() {
    let mut rows = slow("pick_and_place");
    let middle = rows.rows.len() / 2;
    held(&mut rows, middle, 700.0);
    let (rules, calibration) = learned(&rows);
    let [before, after] = events(&rows, &rules, &calibration);
    let issues = issues(before.iter().chain(&after));
    assert!(issues.len() == 1 && issues[0].starts_with("relabeling_stopped"), "{issues:?}");
    let mut ends: BTreeMap<TrackId, f64> = BTreeMap::new();
    for segment in before.iter().chain(&after).filter(|event| event.is_final()).filter_map(LiveEvent::segment) {
        let end = ends.entry(segment.track()).or_insert_with(|| rows.rows[0][0]);
        assert!((segment.start_s() - *end).abs() < 1e-9, "{segment} begins, {end} s was the end of the one before");
        *end = segment.end_s();
    }
    let last = rows.rows.last().unwrap()[0];
    assert!(ends.values().all(|end| (end - last).abs() < 0.02), "{ends:?} {last}");
}

/// One cell that is wrong, two, or the last one, is reported as of a whole log, and changes no segment and no task.
#[test]
fn a_sample_that_cannot_be_is_reported_and_changes_nothing() {
    let plain = Rows::of(&demonstration("pick_and_place"));
    let (rules, calibration) = learned(&plain);
    let named = |rows: &Rows| {
        let [before, after] = events(rows, &rules, &calibration);
        let all = || before.iter().chain(&after);
        let segments = all().filter(|event| event.is_final()).filter_map(LiveEvent::segment);
        let mut names: Vec<String> = segments.map(|it| format!("{} {:?}", it.primitive(), it.object())).collect();
        names.extend(all().filter(|it| it.is_final()).filter_map(LiveEvent::task).map(|it| it.name().to_string()));
        let issues: Vec<String> = all()
            .filter_map(LiveEvent::issue)
            .filter(|issue| issue.kind != "not_a_number")
            .map(|issue| format!("{} {}", issue.kind.name(), issue.channel))
            .collect();
        (names, issues)
    };
    let (wanted, none) = named(&plain);
    assert!(wanted.len() > 6 && none.is_empty(), "{wanted:?} {none:?}");
    let last = plain.rows.len() - 1;
    type Change = fn(f64) -> f64;
    let lost: Change = |value| (value * 1e6).round();
    let cases: [(&str, &[usize], Change, &str); 9] = [
        ("box.velocity.y", &[1900], lost, "impossible_jump box.velocity"),
        ("box.angular_velocity.z", &[1900], |_| 30.0, "impossible_jump box.angular_velocity"),
        ("contact.box.base.force.z", &[100], |value| value * 1e4, "impossible_jump contact.box.base.force"),
        ("right.thumb.position.x", &[1900, 1901], |_| 2.0, "impossible_jump right.thumb.position"),
        ("right.thumb.force.y", &[400], |_| 900.0, "impossible_jump right.thumb.force"),
        ("box.position.z", &[0], |_| 1.0, "impossible_jump box.position"),
        ("box.position.z", &[last], |_| 1.0, "impossible_jump box.position"),
        ("box.rotation.w", &[1900], lost, "implausible_rotation box.rotation"),
        ("box.rotation.w", &[1900], |value| value * 3.0, "implausible_rotation box.rotation"),
    ];
    for (column, at, change, reported) in cases {
        let mut rows = plain.clone();
        let column_at = rows.titles.iter().position(|title| title == column).unwrap();
        at.iter().for_each(|at| rows.rows[*at][column_at] = change(rows.rows[*at][column_at]));
        let (names, issues) = named(&rows);
        assert_eq!(issues, [reported], "{column} {at:?}");
        assert_eq!(names, wanted, "{column} {at:?}");
    }
}

/// What changes for good was measured, and no row waits for more than a moment.
#[test]
fn what_changes_and_stays_is_not_a_fault_of_a_row() {
    let mut rows = Rows::of(&demonstration("pick_and_place"));
    let (rules, calibration) = learned(&rows);
    let column = rows.titles.iter().position(|title| title == "right.thumb.force.y").unwrap();
    rows.rows[1900..1903].iter_mut().for_each(|row| row[column] = 900.0);
    let [before, after] = events(&rows, &rules, &calibration);
    assert_eq!(issues(before.iter().chain(&after)), Vec::<String>::new());
    assert_eq!(crate::live_log::reported(before.iter().chain(&after)), whole(&rules.analyze(&rows.log()).unwrap()));
}
