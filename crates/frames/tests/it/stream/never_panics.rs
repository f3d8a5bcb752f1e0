//! No input may panic: a panic is a bug.

use super::{ask, ask_contact};
use proptest::prelude::*;
use std::io::Cursor;
use teachtree_base::channels::DERIVED;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::Scene;
use teachtree_base::yaml;
use teachtree_frames::bind::{BindingFile, bind};
use teachtree_frames::frames;
use teachtree_logs::names;
use teachtree_logs::read::formats::delimited_text;

const SCENE: &str = "
bodies:
  peg: {role: object, plug: [0 m, 0 m, -20 mm], parts: [{cylinder: [10 mm, 40 mm]}]}
  ring: {role: object, radius: 30 mm, sockets: {hole: {rim: [0 m, 0 m, 0 m], axis: [0, 0, 1], radius: 11 mm, depth: 20 mm}}}
  base: {role: support}
hands:
  left: {fingers: [thumb, index, palm]}
  right: {fingers: [thumb, middle]}
";

const COLUMNS: [&str; 13] = [
    "left.thumb.position",
    "left.thumb.force",
    "left.index.position",
    "left.index.force",
    "right.thumb.position",
    "right.thumb.force",
    "right.middle.force",
    "peg.position",
    "peg.rotation",
    "ring.position",
    "ring.velocity",
    "contact.peg.ring.force",
    "contact.base.peg.force",
];

/// Numbers as they occur and as they should not.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![8 => -0.1..0.1f64, 2 => Just(0.0), 1 => any::<f64>(), 1 => Just(f64::NAN)]
}

fn scene() -> Scene {
    yaml::read(SCENE, "scene").unwrap()
}

fn recordings() -> impl Strategy<Value = Recording> {
    let steps = prop::collection::vec(prop_oneof![10 => Just(0.01), 1 => 0.0..0.1f64], 0..60);
    let present = prop::collection::vec(prop::bool::weighted(0.9), COLUMNS.len());
    (steps, present).prop_flat_map(|(steps, present)| {
        let time: Vec<f64> = steps
            .iter()
            .scan(0.0, |time, step| {
                *time += step;
                Some(*time)
            })
            .collect();
        let wanted: Vec<String> = COLUMNS
            .into_iter()
            .zip(present)
            .filter(|(_, present)| *present)
            .flat_map(|(channel, _)| LogChannel::parse(channel).unwrap().columns())
            .collect();
        let values = prop::collection::vec(prop::collection::vec(number(), time.len()), wanted.len());
        values.prop_map(move |values| {
            let column = |(name, values): (&String, Vec<f64>)| {
                (name.clone(), Column { dimension: names::meaning(name).unwrap().dimension, values })
            };
            Recording {
                time: time.clone(),
                columns: wanted.iter().zip(values).map(column).collect(),
                scene: scene(),
                ..Recording::default()
            }
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn frames_of_any_recording(recording in recordings()) {
        let mut channels: Vec<_> = DERIVED.iter().map(|channel| ask(channel.name)).collect();
        channels.push(ask_contact());
        if let Ok(frames) = frames(&recording, &channels) {
            for (key, column) in &frames.columns {
                prop_assert_eq!(column.len(), frames.len, "{:?}", key);
            }
            // What was not measured, or cannot be meant, never reaches the rules.
            prop_assert!(frames.columns.values().flatten().all(|value| value.is_finite()));
            prop_assert_eq!(frames.stretches.iter().map(ExactSizeIterator::len).sum::<usize>(), frames.len);
        }
    }

    #[test]
    fn any_bytes_as_a_log(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        read(bytes);
    }

    #[test]
    fn nearly_a_log(text in "time \\[s\\],cube\\.position\\.x\n([0-9.,e\\-\"\n]{0,80})") {
        read(text.into_bytes());
    }

    #[test]
    fn any_text_as_a_binding(text in "\\PC{0,200}") {
        let _ = BindingFile::parse(text, "binding.yaml".into());
    }

    #[test]
    fn nearly_a_binding(key in "[a-z<>.]{0,20}", pattern in "[a-z<>=. \\[\\]\\-]{0,30}") {
        let text = format!("time: t\nchannels:\n  \"{key}\": \"{pattern}\"\n  <object>.position: x<xyz>\n");
        if let Ok(file) = BindingFile::parse(text, "binding.yaml".into()) {
            let log = b"t,xx,xy,xz\n0,1,2,3\n0.1,1,2,3\n".to_vec();
            let source = delimited_text::source(Box::new(Cursor::new(log)), "log.csv").unwrap();
            let _ = bind(source, &file, scene());
        }
    }
}

/// Reads bytes as a canonical log, through a binding that says nothing.
fn read(bytes: Vec<u8>) {
    let file = BindingFile::parse("resample: 100 Hz".into(), "binding.yaml".into()).unwrap();
    if let Ok(source) = delimited_text::source(Box::new(Cursor::new(bytes)), "log.csv")
        && let Ok(read) = bind(source, &file, scene())
    {
        let _ = frames(&read.recording, &[ask("target"), ask("target.velocity")]);
    }
}
