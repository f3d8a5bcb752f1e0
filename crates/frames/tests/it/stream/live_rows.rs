//! Rows of a live log: messages of topics, bound as they come, are the rows of the whole log.

use proptest::prelude::*;
use teachtree_base::recording::Recording;
use teachtree_frames::bind::{BindingFile, RowBinder, bind};
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};
use teachtree_logs::read::table::{Sheet, Source};

const BINDING: &str = "
resample: 100 Hz
channels:
  right.palm.position: /arm.p<xyz>
  right.palm.rotation: /arm.q<wxyz>
  right.thumb.force: /wrench.f<xyz>
  right.thumb.contact: /wrench.touches
  cube.position: /camera.p<xyz>
scene: {bodies: {cube: {role: object, radius: 20 mm}}, hands: {right: {fingers: [thumb]}}}
";

/// What a binding may say of sensors besides.
const SENSORS: [&str; 4] = [
    "",
    "tare: {channels: [right.thumb.force], from: 0.1 s, to: 0.6 s}",
    "
tare: {channels: [right.thumb.force, cube.position], from: 0 s, to: 0.3 s}
sensors: {right.thumb.force: {frame: right.palm.rotation, mounted: [0.6, 0.8, 0, 0], tool: 300 g}}
",
    "sensors: {right.thumb.force: {time_offset: -15 ms}, cube.position: {time_offset: -40 ms}, right.palm.rotation: {time_offset: 5 ms}}",
];

/// A sample of a topic: how long after the one before, ms, how much later it comes than it was measured, ms, and whether its first value was not measured.
type Sample = (u32, u32, bool);

/// Samples about every `step` ms, some of which lack, in a topic that is up to `late` ms late.
fn samples(step: u32, late: u32, count: usize) -> impl Strategy<Value = Vec<Sample>> {
    let after = prop_oneof![30 => step - 2..=step + 2, 2 => step..=12 * step, 1 => 200..400_u32];
    prop::collection::vec((after, 0..=late, prop::bool::weighted(0.05)), count)
}

/// The names of a topic's values, and what they are at a time: nothing moves faster than hands do, and no sensor repeats itself.
fn values(topic: &str, time_s: f64) -> Vec<(&'static str, f64)> {
    let wave = |rate: f64, size: f64| size * (rate * time_s).sin();
    let half = wave(0.7, 0.5);
    match topic {
        "/arm" => {
            let position = [("px", wave(1.1, 0.1)), ("py", wave(0.9, 0.1)), ("pz", 0.3 + wave(1.3, 0.1))];
            let rotation = [("qw", half.cos()), ("qx", 0.0), ("qy", half.sin()), ("qz", 0.0)];
            position.into_iter().chain(rotation).collect()
        }
        "/wrench" => {
            let touches = f64::from(u8::from(wave(2.0, 1.0) > 0.0));
            vec![("fx", wave(3.0, 1.0)), ("fy", wave(2.0, 2.0)), ("fz", 4.0 + wave(1.0, 1.0)), ("touches", touches)]
        }
        _ => vec![("px", wave(0.8, 0.1)), ("py", wave(0.6, 0.1)), ("pz", wave(0.4, 0.1))],
    }
}

/// A message: when it comes, ms, its topic and stamp, s, and its values.
type Message = (u32, &'static str, f64, Vec<(&'static str, f64)>);

/// The messages of topics in the order in which they come; those of a topic come in the order of their stamps.
fn messages(topics: &[(&'static str, Vec<Sample>)]) -> Vec<Message> {
    let mut messages = vec![];
    for (topic, samples) in topics {
        let (mut stamp_ms, mut came_ms) = (0, 0);
        for (after_ms, late_ms, lacks) in samples {
            stamp_ms += after_ms;
            came_ms = came_ms.max(stamp_ms + late_ms);
            let time_s = f64::from(stamp_ms) * 1e-3;
            let mut values = values(topic, time_s);
            if *lacks {
                values[0].1 = f64::NAN;
            }
            messages.push((came_ms, *topic, time_s, values));
        }
    }
    messages.sort_by_key(|message| message.0);
    messages
}

/// The rows that are made of messages one by one: each a stamp and values by name. Or why none can be made.
fn one_by_one(messages: &[Message], path: &std::path::Path) -> Result<Vec<Vec<(String, f64)>>, String> {
    let mut binder = RowBinder::open(path, None, 1.0).unwrap();
    let mut rows = vec![];
    for (_, topic, time_s, values) in messages {
        let mut row = InMemoryTable::new("log");
        row.begin_row().unwrap();
        for (name, value) in values {
            row.put(name, *value).unwrap();
        }
        let bound = binder.bind_message(topic, *time_s, &row).unwrap();
        if let Some(fault) = bound.fault {
            return Err(fault.message);
        }
        rows.extend(bound.rows);
    }
    let bound = binder.finish().unwrap();
    if let Some(fault) = bound.fault {
        return Err(fault.message);
    }
    rows.extend(bound.rows);
    let cells = |row: InMemoryTable| {
        let cell = |(name, cells): (&String, &Cells)| (name.clone(), cells.numbers().unwrap()[0]);
        row.columns().iter().map(cell).collect()
    };
    Ok(rows.into_iter().map(cells).collect())
}

/// Returns the recording of all messages at once, or the error.
fn at_once(messages: &[Message], binding: &str) -> Result<Recording, String> {
    let mut tables: indexmap::IndexMap<&str, InMemoryTable> = indexmap::IndexMap::new();
    for (_, topic, time_s, values) in messages {
        let table = tables.entry(topic).or_insert_with(|| InMemoryTable::new("log"));
        table.begin_row().unwrap();
        table.put("time", *time_s).unwrap();
        for (name, value) in values {
            table.put(name, *value).unwrap();
        }
    }
    let sheet = |(name, rows): (&str, InMemoryTable)| Sheet::new(name, rows.header(), Box::new(rows));
    let source = Source::many("log", tables.into_iter().map(sheet).collect());
    let file = BindingFile::parse(binding.into(), "binding".into()).unwrap();
    let scene = file.binding.scene.clone().unwrap();
    bind(source, &file, scene).map(|read| read.recording).map_err(|error| error.message)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn messages_make_the_rows_of_the_whole_log(
        arm in samples(10, 20, 150),
        wrench in samples(5, 0, 300),
        camera in samples(33, 150, 50),
        sensors in prop::sample::select(&SENSORS[..]),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cell.binding.yaml");
        let binding = format!("{BINDING}{sensors}");
        std::fs::write(&path, &binding).unwrap();
        let messages = messages(&[("/arm", arm), ("/wrench", wrench), ("/camera", camera)]);
        let (rows, whole) = match (one_by_one(&messages, &path), at_once(&messages, &binding)) {
            (Ok(rows), Ok(whole)) => (rows, whole),
            (rows, whole) => {
                prop_assert_eq!(rows.err(), whole.err());
                return Ok(());
            }
        };
        // At the end the whole log leaves out rows that some sensor lacks.
        prop_assert!(rows.len() >= whole.time.len(), "{} of {}", rows.len(), whole.time.len());
        for (at, time) in whole.time.iter().enumerate() {
            let value = |name: &str| rows[at].iter().find(|(known, _)| known == name).map_or(f64::NAN, |(_, value)| *value);
            prop_assert_eq!(value("time"), *time);
            for (name, column) in &whole.columns {
                let (found, wanted) = (value(name), column.values[at]);
                prop_assert!(found == wanted || found.is_nan() && wanted.is_nan(), "{name} at {time} s: {found}, not {wanted}");
            }
        }
    }
}
