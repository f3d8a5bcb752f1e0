//! The measured logs: the table of the engine's job, and repeated demonstrations of the virtual environment.

#[path = "../engine/job/data.rs"]
#[allow(dead_code, reason = "the engine's bench uses more of it")]
mod data;

pub use data::CHANNELS;

use parquet::basic::{Compression, Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use std::sync::Arc;
use teachtree_base::recording::Recording;
use teachtree_base::yaml;
use teachtree_world::shipped;
use teachtree_world::teach;

/// Rows of a row group.
const GROUP: usize = 1 << 17;

/// The table of the job, as text with the digits that 32 bits have, and as Parquet with 64 bits.
pub fn job(rows: usize, csv: &Path, parquet: &Path) {
    let rows = data::rows(rows, 1);
    let mut text = String::from("time [s]");
    (0..CHANNELS).for_each(|channel| write!(text, ",c{channel}").expect("text"));
    text.push('\n');
    for (frame, row) in rows.iter().enumerate() {
        write!(text, "{}", frame as f64 / 1000.0).expect("text");
        row.iter().for_each(|value| write!(text, ",{value}").expect("text"));
        text.push('\n');
    }
    std::fs::write(csv, text).expect("there is room");
    let titles: Vec<String> =
        std::iter::once("time [s]".to_string()).chain((0..CHANNELS).map(|channel| format!("c{channel}"))).collect();
    write_parquet(parquet, &titles, "", rows.len(), |column, row| match column {
        0 => row as f64 / 1000.0,
        column => f64::from(rows[row][column - 1]),
    });
}

/// Writes a repeated demonstration with one hand or two as Parquet. Numbers differ between repetitions as those of sensors do, so that
/// they cannot be compressed.
pub fn two_hands(frames: usize, path: &Path) {
    let recording = taught("hold_and_insert");
    let (titles, columns) = columns(&recording);
    let scene = yaml::write(&recording.scene).expect("a scene is text");
    write_parquet(path, &titles, &scene, frames, |column, row| value(&columns, column, row));
}

/// The same with one hand, as text.
pub fn one_hand_csv(frames: usize, path: &Path) {
    let recording = taught("pick_and_place");
    let (titles, columns) = columns(&recording);
    let scene = yaml::write(&recording.scene).expect("a scene is text");
    std::fs::write(path.with_extension("scene.yaml"), scene).expect("there is room");
    let mut out = BufWriter::new(File::create(path).expect("there is room"));
    writeln!(out, "{}", titles.join(",")).expect("there is room");
    for row in 0..frames {
        for column in 0..titles.len() {
            let delimiter = if column == 0 { "" } else { "," };
            // The usual number of digits of a logger.
            let value = value(&columns, column, row);
            write!(out, "{delimiter}{}", (value * 1e7).round() / 1e7).expect("there is room");
        }
        writeln!(out).expect("there is room");
    }
    out.flush().expect("there is room");
}

fn taught(name: &str) -> Recording {
    let scene = shipped::scene(name).expect("it is shipped");
    let operator = shipped::operator(name).expect("it is shipped");
    teach(&scene, &operator, 3).expect("it is taught")
}

/// Returns the titles and the columns; `None` for the time.
fn columns(recording: &Recording) -> (Vec<String>, Vec<&[f64]>) {
    let title = |(name, column): (&String, &teachtree_base::recording::Column)| match column.dimension.si_unit() {
        unit if unit.is_empty() => name.clone(),
        unit => format!("{name} [{unit}]"),
    };
    let titles = std::iter::once("time [s]".to_string()).chain(recording.columns.iter().map(title)).collect();
    let columns = recording.columns.values().map(|column| column.values.as_slice());
    (titles, std::iter::once(&[][..]).chain(columns).collect())
}

/// Returns a value of a repeated demonstration.
fn value(columns: &[&[f64]], column: usize, row: usize) -> f64 {
    let values = columns[column];
    if values.is_empty() {
        return row as f64 / 1000.0;
    }
    let value = values[row % values.len()];
    if value == 0.0 || value == 1.0 {
        return value;
    }
    // A relative change of 1e-9, determined by the position.
    let mixed = (row as u64 ^ ((column as u64) << 40)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
    value * (1.0 + (mixed as f64 / (1 << 24) as f64 - 0.5) * 1e-9)
}

fn write_parquet(path: &Path, titles: &[String], scene: &str, rows: usize, value: impl Fn(usize, usize) -> f64) {
    let field = |title: &String| {
        let builder = Type::primitive_type_builder(title, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
        Arc::new(builder.build().expect("a column"))
    };
    let fields = titles.iter().map(field).collect();
    let schema = Type::group_type_builder("log").with_fields(fields).build().expect("a schema");
    let scene = (!scene.is_empty()).then(|| vec![KeyValue::new("teachtree.scene".into(), scene.to_string())]);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_key_value_metadata(scene)
        .build();
    let file = BufWriter::new(File::create(path).expect("there is room"));
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).expect("a file");
    for start in (0..rows).step_by(GROUP) {
        let mut group = writer.next_row_group().expect("there is room");
        let mut place = 0;
        while let Some(mut column) = group.next_column().expect("there is room") {
            let values: Vec<f64> = (start..(start + GROUP).min(rows)).map(|row| value(place, row)).collect();
            column.typed::<DoubleType>().write_batch(&values, None, None).expect("there is room");
            column.close().expect("there is room");
            place += 1;
        }
        group.close().expect("there is room");
    }
    writer.close().expect("there is room");
}
