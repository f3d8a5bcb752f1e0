//! Logs at the ends of what a log may be: very wide, of very many bodies, of very high and very low rates.

use crate::live_log::{Rows, demonstration};
use crate::program::{all_said, teachtree_in};
use std::fmt::Write as _;
use teachtree::{Analysis, Error, Rules, Scene};

/// The segments and tasks, each with its times.
fn labels(rows: &Rows) -> Vec<String> {
    let log = rows.log();
    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    let segments = analysis.segments().into_iter().map(|it| it.to_string());
    segments.chain(analysis.tasks().into_iter().map(|it| it.to_string())).collect()
}

/// What `analyze` finds in a text of these rows.
fn analyze(rows: &Rows, scene: &str) -> Result<Analysis, Error> {
    let folder = tempfile::tempdir().unwrap();
    let [path, place] = ["log.csv", "log.scene.yaml"].map(|name| folder.path().join(name));
    let mut text = rows.titles.join(",");
    for row in &rows.rows {
        let cells: Vec<String> = row.iter().map(f64::to_string).collect();
        let _ = write!(text, "\n{}", cells.join(","));
    }
    std::fs::write(&path, text).unwrap();
    std::fs::write(&place, scene).unwrap();
    let log = teachtree::Log::open(&path)?;
    Rules::for_log(&log)?.analyze(&log)
}

/// A push with every so-manieth of its rows, and its scene as text.
fn push(every: usize) -> (Rows, serde_json::Value) {
    let recording = demonstration("push");
    let mut rows = Rows::of(&recording);
    rows.rows = rows.rows.into_iter().step_by(every).collect();
    (rows, serde_json::to_value(&recording.scene).unwrap())
}

#[test]
fn a_thousand_columns_change_nothing() {
    let (plain, _) = push(20);
    let mut wide = plain.clone();
    wide.titles.extend((wide.titles.len()..1000).map(|at| format!("extra_{at}")));
    for (at, row) in wide.rows.iter_mut().enumerate() {
        row.resize(1000, at as f64);
    }
    assert_eq!(labels(&wide), labels(&plain));
}

#[test]
fn two_hundred_bodies_change_nothing() {
    let (plain, mut scene) = push(50);
    let mut crowded = plain.clone();
    let block = scene["bodies"]["block"].clone();
    for at in scene["bodies"].as_object().unwrap().len()..200 {
        let name = format!("other_{at}");
        // On a grid beside the support, each apart from the others.
        let place = [2.0 + 0.1 * (at % 14) as f64, 2.0 + 0.1 * (at / 14) as f64, 0.025];
        let mut body = block.clone();
        body["position"] = place.map(|it| format!("{it} m")).to_vec().into();
        scene["bodies"][&name] = body;
        let of = |channel: &str, axes: &[&str]| {
            axes.iter().map(|axis| format!("{name}.{channel}.{axis}")).collect::<Vec<_>>()
        };
        crowded.titles.extend([of("position", &["x", "y", "z"]), of("rotation", &["w", "x", "y", "z"])].concat());
        crowded.rows.iter_mut().for_each(|row| row.extend(place.into_iter().chain([1.0, 0.0, 0.0, 0.0])));
        // What it weighs, and upwards: contacts that are not logged would be computed of all pairs.
        let contact = |part: &str| ["x", "y", "z"].map(|axis| format!("contact.{name}.base.{part}.{axis}"));
        crowded.titles.extend(["force", "normal"].map(contact).concat());
        crowded.rows.iter_mut().for_each(|row| row.extend([0.0, 0.0, 0.785, 0.0, 0.0, 1.0]));
    }
    crowded.scene = Scene::parse("scene", &scene.to_string()).unwrap();
    assert_eq!(labels(&crowded), labels(&plain));
}

/// The moment at which a push begins, at 1 kHz and, on straight lines between these rows, at 10 kHz.
#[test]
fn ten_kilohertz_are_read() {
    let (mut plain, scene) = push(1);
    // A push counts that lasts 350 ms before the rows end.
    plain.rows = plain.rows[1100..2100].to_vec();
    let mut fast = plain.clone();
    let is_flag: Vec<bool> = fast.titles.iter().map(|title| title.ends_with(".contact")).collect();
    let between = |pair: &[Vec<f64>], part: f64| {
        let cells = pair[0].iter().zip(&pair[1]).zip(&is_flag);
        cells.map(|((from, to), flag)| if *flag { *from } else { from + (to - from) * part }).collect::<Vec<f64>>()
    };
    let tenths = |pair: &[Vec<f64>]| (0..10).map(|at| between(pair, f64::from(at) / 10.0)).collect::<Vec<_>>();
    fast.rows = plain.rows.windows(2).flat_map(tenths).collect();
    let scene = scene.to_string();
    let of = |rows: &Rows| {
        let analysis = analyze(rows, &scene).unwrap();
        analysis.segments().iter().map(|it| (it.primitive().to_string(), it.start_s(), it.end_s())).collect::<Vec<_>>()
    };
    let (slow, fast) = (of(&plain), of(&fast));
    assert!(slow.len() > 1, "{slow:?}");
    for ((name, start_s, end_s), (same, start, end)) in slow.iter().zip(&fast) {
        assert!(name == same && (start_s - start).abs() < 2e-3 && (end_s - end).abs() < 2e-3, "{slow:?} {fast:?}");
    }
    assert_eq!(slow.len(), fast.len());
}

/// Stamps of 20 Hz whose seconds are called ms look like 20 kHz, and those of 1 kHz in ms without a unit like 1 Hz: such rates are refused.
#[test]
fn rates_that_other_units_would_give_are_refused() {
    let refused = |rows: &Rows, scene: &serde_json::Value| analyze(rows, &scene.to_string()).unwrap_err().to_string();
    let (mut wrong, scene) = push(50);
    wrong.titles[0] = "time [ms]".into();
    let error = refused(&wrong, &scene);
    assert!(error.contains("one row every 0.05 ms, expected at least 0.1 ms and less than 1000 ms"), "{error}");
    let (slow, scene) = push(1000);
    let error = refused(&slow, &scene);
    assert!(error.contains("one row every 1 s, expected at least 0.1 ms and less than 1000 ms"), "{error}");
    // A rate that is low enough for no mistake is one at which the rules would not see what lasts 50 ms.
    let (quicker, scene) = push(800);
    let error = refused(&quicker, &scene);
    assert!(error.contains("a duration of 50.000 ms is shorter than one sample (800.000 ms"), "{error}");
}

/// The rate is the binding's, so the error is at its line.
#[test]
fn a_binding_that_resamples_too_slowly_is_refused_at_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut log = String::from("time,x,z,closed\n");
    for row in 0..200 {
        let _ = writeln!(log, "{:.2},0.3,0.02,{}", f64::from(row) * 0.02, u8::from(row > 100));
    }
    let binding = "resample: 15 Hz
channels:
  right.tcp.position: [\"x [m]\", \"= 0 m\", \"z [m]\"]
  right.gripper.closed: closed
  box.position: [\"x [m]\", \"= 0 m\", \"z [m]\"]
scene: {bodies: {box: {role: object, radius: 30 mm}}}
";
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    let analyzed = |rate: &str| {
        std::fs::write(folder.path().join("b.yaml"), binding.replace("15 Hz", rate)).unwrap();
        teachtree_in(folder.path(), &["analyze", "log.csv", "--binding", "b.yaml"])
    };
    let refused = analyzed("15 Hz");
    let text = all_said(&refused);
    assert_eq!(refused.status.code(), Some(2), "{text}");
    assert!(
        text.contains("b.yaml:1:") && text.contains("`resample: 15 Hz` is too slow for `dwell` of 50 ms"),
        "{text}"
    );
    assert!(text.contains("use at least `resample: 20 Hz`"), "{text}");
    assert!(analyzed("20 Hz").status.success(), "{}", all_said(&analyzed("20 Hz")));
}
