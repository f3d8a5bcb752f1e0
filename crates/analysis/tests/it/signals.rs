//! Audits without rules: planted faults of stamps, numbers and pictures are found with column, time and number, and nothing else is.

use teachtree_analysis::audit::signals::{EpisodeDeclaration, facts};
use teachtree_analysis::audit::{Facts, Finding, FindingKind};
use teachtree_frames::raw_log::{RawLog, RawTable};

const FPS: f64 = 20.0;
const ROWS: usize = 300;

/// An arm that moves all the time, at 20 Hz, with noise.
fn episode() -> RawLog {
    let noise = |row: usize, salt: usize| {
        let bits = (row.wrapping_mul(2_654_435_761) ^ salt.wrapping_mul(40_503)).wrapping_mul(2_246_822_519) >> 7;
        (bits % 1000) as f64 / 1000.0 - 0.5
    };
    let joint = |salt: usize| -> Vec<f64> {
        (0..ROWS).map(|row| 40.0 * (row as f64 / 30.0 + salt as f64).sin() + 0.05 * noise(row, salt)).collect()
    };
    let counted = |from: usize| (0..ROWS).map(|row| (from + row) as f64).collect();
    let columns = vec![
        ("observation.state.pan".to_string(), joint(1)),
        ("observation.state.lift".to_string(), joint(2)),
        ("frame_index".to_string(), counted(0)),
        ("index".to_string(), counted(5000)),
    ];
    let stamps_s = (0..ROWS).map(|row| f64::from((row as f64 / FPS) as f32)).collect();
    let pictures = vec![("observation.images.top".to_string(), (1..=ROWS as u64).collect())];
    RawLog { tables: vec![RawTable { stamps_s, columns, pictures, ..RawTable::default() }], ..RawLog::default() }
}

fn declared() -> EpisodeDeclaration {
    EpisodeDeclaration {
        fps: Some(FPS),
        frames: Some(ROWS),
        videos: vec![("observation.images.top".into(), ROWS as u64)],
    }
}

fn audit(change: impl FnOnce(&mut RawTable)) -> Facts {
    let mut log = episode();
    change(&mut log.tables[0]);
    facts(&log, &EpisodeDeclaration { frames: Some(log.tables[0].stamps_s.len()), ..declared() }, 3.0).0
}

/// Kind, column, start and number.
type Found<'a> = (FindingKind, Option<&'a str>, Option<f64>, Option<f64>);

fn found(facts: &Facts) -> Vec<Found<'_>> {
    let rounded = |value: f64| (value * 1000.0).round() / 1000.0;
    let of = |finding: &'_ Finding| {
        let start = finding.span_s.map(|[start, _]| rounded(start));
        (finding.kind, start, finding.value.map(rounded))
    };
    facts.findings.iter().map(|it| (of(it).0, it.column.as_deref(), of(it).1, of(it).2)).collect()
}

fn joint(table: &mut RawTable) -> &mut Vec<f64> {
    &mut table.columns[0].1
}

#[test]
fn a_good_episode_has_no_finding() {
    let (facts, unchecked) = facts(&episode(), &declared(), 3.0);
    assert_eq!((found(&facts), unchecked), (vec![], vec![]));
    assert_eq!(facts.idle_share(), 0.0);
}

#[test]
fn frames_are_missing() {
    let facts = audit(|table| {
        table.stamps_s.drain(60..63);
        table.columns.iter_mut().for_each(|(_, values)| drop(values.drain(60..63)));
        table.pictures[0].1.drain(60..63);
    });
    let joint = found(&facts);
    let kind = FindingKind::MissingFrames;
    assert_eq!(joint[0], (kind, Some("time"), Some(2.95), Some(3.0)));
    assert_eq!(joint[1], (kind, Some("frame_index"), Some(2.95), Some(3.0)));
    assert_eq!(facts.findings[0].message, "3 frames are missing: no stamp for 0.2 s, the usual step is 0.05 s");
    // The video has three frames more than the episode then, which it may.
    assert_eq!(joint.len(), 2);
}

#[test]
fn a_late_frame_is_not_a_gap() {
    let facts = audit(|table| table.stamps_s[100] += 0.03);
    assert_eq!(found(&facts), vec![]);
}

#[test]
fn stamps_are_uneven_equal_or_go_back() {
    let uneven = audit(|table| (0..ROWS).step_by(4).for_each(|row| table.stamps_s[row] += 0.012));
    assert_eq!(found(&uneven), [(FindingKind::UnevenStamps, Some("time"), None, Some(0.498))]);
    let equal = audit(|table| table.stamps_s[50] = table.stamps_s[49]);
    assert_eq!(found(&equal), [(FindingKind::EqualStamps, Some("time"), Some(2.45), Some(1.0))]);
    let back = audit(|table| table.stamps_s[120..].iter_mut().for_each(|stamp| *stamp -= 4.0));
    assert_eq!(found(&back), [(FindingKind::StampsBack, Some("time"), Some(2.0), Some(3.95))]);
    let rate = audit(|table| table.stamps_s.iter_mut().for_each(|stamp| *stamp *= 2.0));
    assert_eq!(found(&rate), [(FindingKind::UnevenStamps, Some("time"), None, Some(10.0))]);
}

#[test]
fn rests_have_their_share() {
    let facts = audit(|table| {
        for (_, values) in &mut table.columns[..2] {
            let held = values[100];
            values[100..180].iter_mut().enumerate().for_each(|(at, value)| *value = held + 0.02 * (at % 3) as f64);
        }
    });
    let [(FindingKind::Idle, None, Some(start), Some(length))] = found(&facts)[..] else {
        panic!("{:?}", facts.findings)
    };
    assert!((start - 5.0).abs() < 0.15 && (length - 4.0).abs() < 0.15, "{start} {length}");
    assert!((facts.idle_share() - 4.0 / 14.95).abs() < 0.02);
    // An episode in which nothing moves at all is one rest.
    let still = audit(|table| table.columns[..2].iter_mut().for_each(|(_, values)| values.fill(1.5)));
    assert_eq!(found(&still), [(FindingKind::Idle, None, Some(0.0), Some(14.95))]);
}

#[test]
fn spikes_differ_from_motion() {
    let facts = audit(|table| {
        joint(table)[70] = 95.0;
        joint(table)[140] = -80.0;
    });
    let [(FindingKind::Spike, Some("observation.state.pan"), Some(time), Some(away))] = found(&facts)[..] else {
        panic!("{:?}", facts.findings)
    };
    assert!(time == 3.5 || time == 7.0);
    assert!(away > 60.0);
    assert!(facts.findings[0].message.starts_with("2 spikes, the largest to "), "{}", facts.findings[0].message);
    // A step stays, a turn of an angle comes back a whole turn away, and a quaternion may change its sign.
    assert_eq!(found(&audit(|table| joint(table)[70..].iter_mut().for_each(|value| *value += 60.0))), vec![]);
    assert_eq!(found(&audit(|table| joint(table)[70] -= 360.0)), vec![]);
    assert_eq!(found(&audit(|table| joint(table)[40] *= -1.0)), vec![]);
    // A force may have a peak.
    let force = audit(|table| {
        table.columns[0].0 = "observation.state.effort.pan".into();
        joint(table)[70] = 95.0;
    });
    assert_eq!(found(&force), vec![]);
}

#[test]
fn a_camera_freezes_while_the_arm_moves() {
    let facts = audit(|table| table.pictures[0].1[40..90].fill(41));
    let camera = Some("observation.images.top");
    assert_eq!(found(&facts), [(FindingKind::FrozenCamera, camera, Some(2.0), Some(2.45))]);
    // While nothing moves, an unchanged picture is right.
    let still = audit(|table| {
        table.pictures[0].1[40..90].fill(41);
        table.columns[..2].iter_mut().for_each(|(_, values)| values.fill(1.5));
    });
    assert_eq!(found(&still), [(FindingKind::Idle, None, Some(0.0), Some(14.95))]);
    // A video that ends early.
    let videos = vec![("observation.images.top".into(), 290)];
    let (short, _) =
        teachtree_analysis::audit::signals::facts(&episode(), &EpisodeDeclaration { videos, ..declared() }, 3.0);
    assert_eq!(found(&short), [(FindingKind::MissingFrames, camera, Some(14.5), Some(10.0))]);
}

#[test]
fn topics_that_are_not_periodic_have_no_gaps() {
    let topic = |stamps_s: Vec<f64>, writers: Vec<usize>| {
        let values = stamps_s.iter().map(|stamp| (3.0 * stamp).sin()).collect();
        let columns = vec![("position.pan".to_string(), values)];
        RawTable { name: "/joints".into(), is_topic: true, stamps_s, writers, columns, pictures: vec![] }
    };
    let audit = |table: RawTable| {
        let log = RawLog { tables: vec![table], ..RawLog::default() };
        facts(&log, &EpisodeDeclaration::default(), 3.0).0
    };
    let even: Vec<f64> = (0..100).map(|at| f64::from(at) * 0.01).collect();
    // Commands come when they are given.
    let events: Vec<f64> = (0..100).map(|at| (f64::from(at) * 0.7).powi(2) / 100.0).collect();
    assert_eq!(found(&audit(topic(events, vec![]))), vec![]);
    let mut gap = even.clone();
    gap.drain(30..50);
    assert_eq!(
        found(&audit(topic(gap, vec![]))),
        [(FindingKind::MissingFrames, Some("/joints"), Some(0.29), Some(20.0))]
    );
    // Two senders with clocks of their own.
    let pairs = even.iter().flat_map(|stamp| [*stamp, stamp - 0.004]).collect();
    assert_eq!(found(&audit(topic(pairs, [0, 1].repeat(100)))), vec![]);
}
