//! Poses of a camera of 15 Hz in a log of 60 Hz: repeated, and interpolated.

use super::{ask, ask_contact, column};
use crate::shared::recordings::recording;
use proptest::collection::vec;
use proptest::prelude::*;
use teachtree_base::recording::Recording;
use teachtree_frames::live::{Calibration, Derivation, LiveChunk};
use teachtree_frames::streaming::StreamedLog;
use teachtree_frames::{OpenRequest, frames, open};
use teachtree_logs::read::csv;
use teachtree_world::{shipped, teach};

const SCENE: &str = "
bodies:
  cube: {role: object, parts: [{box: [40 mm, 40 mm, 40 mm]}]}
  table: {role: support}
hands:
  right: {fingers: [thumb, index]}
";

/// The pose of the cube: it rests for 1 s, and goes and turns for 4 s with up to 0.4 m/s.
fn way(t: f64) -> f64 {
    0.25 * (1.0 - (t - 1.0).clamp(0.0, 4.0).cos())
}

fn log() -> Recording {
    recording(
        SCENE,
        60.0,
        360,
        &[
            ("right.thumb.position.x", &way),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &|_| 0.02),
            ("right.thumb.force.x", &|_| 0.0),
            ("right.thumb.force.y", &|_| 0.0),
            ("right.thumb.force.z", &|t| if (0.5..5.5).contains(&t) { 3.0 + 0.2 * (20.0 * t).sin() } else { 0.0 }),
            ("cube.position.x", &way),
            ("cube.position.y", &|t| -way(t)),
            ("cube.position.z", &|_| 0.02),
            ("cube.rotation.w", &|t| (2.0 * way(t)).cos()),
            ("cube.rotation.x", &|_| 0.0),
            ("cube.rotation.y", &|_| 0.0),
            ("cube.rotation.z", &|t| (2.0 * way(t)).sin()),
            ("contact.cube.table.force.x", &|_| 0.0),
            ("contact.cube.table.force.y", &|_| 0.0),
            ("contact.cube.table.force.z", &|t| f64::from(u8::from(t < 1.0))),
        ],
    )
}

/// The log with a pose of the cube in each of these rows, which the rows after it repeat.
fn held(measured: impl Fn(usize) -> bool) -> Recording {
    let mut log = log();
    hold(&mut log, "cube.", measured);
    log
}

fn hold(log: &mut Recording, body: &str, measured: impl Fn(usize) -> bool) {
    for (_, column) in log.columns.iter_mut().filter(|(name, _)| name.starts_with(body)) {
        for row in 1..column.values.len() {
            if !measured(row) {
                column.values[row] = column.values[row - 1];
            }
        }
    }
}

/// The channels with an issue, with the number of rows that it names.
fn reported(log: &Recording) -> Vec<(String, String)> {
    let issues = frames(log, &[ask("target.position")]).unwrap().issues;
    let rows = |message: &str| message.split_whitespace().nth(7).unwrap().to_string();
    issues.iter().filter(|it| it.kind == "held_pose").map(|it| (it.channel.clone(), rows(&it.message))).collect()
}

/// The rates that the issues name.
fn stated_rates_hz(log: &Recording) -> Vec<f64> {
    let issues = frames(log, &[ask("target.position")]).unwrap().issues;
    let rate = |message: &str| message.split(" Hz").next()?.rsplit(' ').next()?.parse().ok();
    issues.iter().filter(|it| it.kind == "held_pose").map(|it| rate(&it.message).unwrap()).collect()
}

#[test]
fn poses_that_are_held_are_interpolated() {
    let both = |rows: &str| ["cube.position", "cube.rotation"].map(|channel| (channel.to_string(), rows.to_string()));
    // A camera of 13 Hz is held for 4 or 5 rows, one of 40 Hz for 1 or 2.
    type Measured<'a> = &'a dyn Fn(usize) -> bool;
    let measured: [(Measured, &str, f64); 3] = [
        (&|row| row % 4 == 0, "4", 15.0),
        (&|row| row * 13 / 60 != (row - 1) * 13 / 60, "5", 13.0),
        (&|row| row * 40 / 60 != (row - 1) * 40 / 60, "2", 40.0),
    ];
    for (measured, rows, rate_hz) in measured {
        let log = held(measured);
        assert_eq!(reported(&log), both(rows));
        for stated_hz in stated_rates_hz(&log) {
            assert!((stated_hz - rate_hz).abs() <= 1.0, "{stated_hz} {rate_hz}");
        }
        let found = frames(&log, &[ask("target.position"), ask("target.velocity"), ask("target.rotation")]).unwrap();
        let (x, z) = (column(&found, "target.position", 0, 0), column(&found, "target.rotation", 0, 3));
        for (row, t) in log.time.iter().enumerate() {
            assert!((x[row] - way(*t)).abs() < 1e-3, "{rows} {row}: {} {}", x[row], way(*t));
            assert!((z[row] - (2.0 * way(*t)).sin()).abs() < 1e-3, "{rows} {row}: {}", z[row]);
        }
        // The beginning of its motion is not smeared over the rest before.
        assert!(x[..55].iter().all(|x| *x == 0.0), "{:?}", &x[50..60]);
    }
}

#[test]
fn other_poses_are_used_unchanged() {
    let exact = log();
    assert_eq!(reported(&exact), vec![]);
    // A slow body whose position is rounded repeats its pose too.
    let rounded = [5e-4, 1e-3, 2e-3].map(|step| {
        let mut log = exact.clone();
        let places = log.columns.iter_mut().filter(|(name, _)| name.starts_with("cube.position"));
        for value in places.flat_map(|(_, column)| &mut column.values) {
            *value = (*value / 5.0 / step).round() * step;
        }
        assert_eq!(reported(&log), vec![], "{step}");
        log
    });
    // A camera that lost a pose now and then.
    assert_eq!(reported(&held(|row| row % 40 != 0)), vec![]);
    for log in [exact].into_iter().chain(rounded) {
        let found = frames(&log, &[ask("target.position")]).unwrap();
        assert_eq!(column(&found, "target.position", 0, 0), log.columns["cube.position.x"].values);
    }
}

/// The cube moves with the thumb: while a pose is held it seems to stop, which the newest frames must not show.
#[test]
fn the_newest_frames_end_before_a_pose_that_is_still_held() {
    let log = held(|row| row % 4 == 0);
    let channels = [ask("target.position")];
    let (calibration, _) = Calibration::of(&log, &channels, true).unwrap();
    let columns: Vec<_> = log.columns.iter().map(|(name, column)| (name.clone(), column.dimension)).collect();
    let mut derivation = Derivation::new(log.scene.clone(), channels.to_vec(), calibration, columns);
    let mut given = 0;
    for (row, time_s) in log.time.iter().enumerate() {
        let values: Vec<f64> = log.columns.values().map(|column| column.values[row]).collect();
        derivation.push(*time_s, &values);
        let mut take = |chunk: LiveChunk| {
            let x = &column(chunk.frames, "target.position", 0, 0)[chunk.core.start..chunk.newest.end];
            for (at, x) in x.iter().enumerate() {
                let t = log.time[given + at];
                assert!((x - way(t)).abs() < 1e-3, "{row} {}: {x} {}", given + at, way(t));
            }
            given += chunk.core.len();
            Ok(())
        };
        derivation.settle(row + 1 == log.time.len(), true, &mut take).unwrap();
    }
    assert_eq!(given, log.time.len());
}

/// A log that is larger than memory is derived while it is read, before its end shows whether it repeats poses.
#[test]
fn a_log_with_held_poses_has_to_be_in_memory() {
    let in_windows = |log: &Recording| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        csv::write(log, &path).unwrap();
        let request = OpenRequest { log: path, ..OpenRequest::default() };
        let flow = StreamedLog::open(&request).and_then(|flow| flow.look_through(&[ask_contact()])).unwrap();
        let whole = open(&request).unwrap().frames(&[ask_contact()]).unwrap().issues;
        let found = flow.parts(&mut |_| Ok(())).map_err(|error| error.to_string());
        found.map(|(_, issues)| issues == whole)
    };
    let mut log =
        teach(&shipped::scene("pick_and_place").unwrap(), &shipped::operator("pick_and_place").unwrap(), 1).unwrap();
    assert_eq!(in_windows(&log), Ok(true));
    // 125 Hz: its jumps are not spikes.
    hold(&mut log, "box.position", |row| row % 8 == 0);
    let refused = in_windows(&log).unwrap_err();
    assert!(refused.contains("has to be in memory"), "{refused}");
}

/// A camera of 15 Hz sees a cube at rest, and scatters by this deviation along each axis.
#[test]
fn the_noise_of_held_poses_is_that_of_their_measured_samples() {
    // The sum of twelve evenly distributed numbers has the deviation 1.
    let scatter = |t: f64, axis: usize| {
        let sample = (t * 15.0 + 1e-6) as usize;
        let even = |part: usize| {
            let hash = ((sample * 3 + axis) * 12 + part).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (hash ^ (hash >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) as f64 / u64::MAX as f64 - 0.5
        };
        8e-4 * (0..12).map(even).sum::<f64>()
    };
    let log = recording(
        SCENE,
        60.0,
        1800,
        &[
            ("right.thumb.position.x", &|_| 0.3),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &|t| 0.2 + way(t)),
            ("cube.position.x", &|t| scatter(t, 0)),
            ("cube.position.y", &|t| scatter(t, 1)),
            ("cube.position.z", &|t| 0.02 + scatter(t, 2)),
        ],
    );
    let found = frames(&log, &[ask("target.velocity")]).unwrap();
    assert!(found.issues.iter().any(|issue| issue.kind == "held_pose"), "{:?}", found.issues);
    let noisy = found.issues.iter().find(|issue| issue.kind == "noisy_position").map(|issue| issue.message.as_str());
    assert!(noisy.is_some_and(|message| message.contains("scatter by 0.8 mm")), "{noisy:?}");
    let still = column(&found, "target.velocity", 0, 0).iter().filter(|speed| **speed == 0.0).count();
    assert!(still > 1780, "{still}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn a_live_log_has_the_poses_of_the_whole_log(rows in vec(1..7_usize, 120), gap in 100..260_usize, newest: bool) {
        let mut next = 0;
        let measured: Vec<usize> = rows.iter().map(|rows| { next += rows; next }).collect();
        let mut log = held(|row| measured.contains(&row));
        log.time.iter_mut().skip(gap).for_each(|time| *time += 0.5);
        let channels = [ask("target.position"), ask("target.velocity"), ask("target.angular_velocity")];
        let whole = frames(&log, &channels).unwrap();
        prop_assert!(whole.issues.iter().any(|issue| issue.kind == "held_pose"));
        let (calibration, _) = Calibration::of(&log, &channels, true).unwrap();
        let calibration = Calibration::parse(&calibration.text().unwrap(), "calibration").unwrap();
        let columns: Vec<_> = log.columns.iter().map(|(name, column)| (name.clone(), column.dimension)).collect();
        let mut derivation = Derivation::new(log.scene.clone(), channels.to_vec(), calibration, columns);
        let mut found: Vec<Vec<f64>> = vec![vec![]; 3];
        for (row, time_s) in log.time.iter().enumerate() {
            let values: Vec<f64> = log.columns.values().map(|column| column.values[row]).collect();
            derivation.push(*time_s, &values);
            let mut take = |chunk: LiveChunk| {
                for (found, channel) in found.iter_mut().zip(&channels) {
                    found.extend(&column(chunk.frames, &channel.name, 0, 0)[chunk.core.clone()]);
                }
                Ok(())
            };
            derivation.settle([gap, log.time.len()].contains(&(row + 1)), newest, &mut take).unwrap();
        }
        for (found, channel) in found.iter().zip(&channels) {
            let column = column(&whole, &channel.name, 0, 0);
            let differs = found.iter().zip(column).position(|(live, whole)| live.to_bits() != whole.to_bits());
            prop_assert!(differs.is_none() && found.len() == column.len(), "{} {differs:?}", channel.name);
        }
    }
}
