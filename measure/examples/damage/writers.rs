//! Tables written in each format, as its usual programs write it.

use crate::alteration::Table;
use crate::sources::TOPIC;
use std::io::{Cursor, Write as _};
use teachtree_base::recording::Recording;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;

/// What stands for a point in the names of fields of a bag.
pub const BETWEEN: &str = "__";

/// The number of a cell; what is none was not measured.
fn number(cell: &str) -> f64 {
    cell.trim().parse().unwrap_or(f64::NAN)
}

/// The values of a column.
fn column(table: &Table, at: usize) -> impl Iterator<Item = f64> {
    table.rows.iter().map(move |row| row.get(at).map_or(f64::NAN, |cell| number(cell)))
}

/// Each row as an object of JSON, with its stamp.
fn objects(table: &Table) -> impl Iterator<Item = (f64, String)> {
    table.rows.iter().map(|row| {
        let cell = |(title, cell): (&String, &String)| match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => format!("\"{title}\": {cell}"),
            _ if cell.is_empty() => format!("\"{title}\": null"),
            _ => format!("\"{title}\": {}", serde_json::Value::from(cell.as_str())),
        };
        let cells: Vec<String> = table.titles.iter().zip(row).map(cell).collect();
        let time = table.titles.iter().position(|title| title == "time").and_then(|at| row.get(at));
        (time.map_or(f64::NAN, |time| number(time)), format!("{{{}}}", cells.join(", ")))
    })
}

/// Lines of JSON.
pub fn lines(table: &Table) -> Vec<u8> {
    (objects(table).map(|(_, object)| object).collect::<Vec<_>>().join("\n") + "\n").into_bytes()
}

/// A table of Parquet, with the dimensions and the scene of the plain recording.
pub fn parquet(plain: &Recording, table: &Table) -> Option<Vec<u8>> {
    let mut recording = Recording { scene: plain.scene.clone(), ..Recording::default() };
    for (at, title) in table.titles.iter().enumerate() {
        if title == "time" {
            recording.time = column(table, at).collect();
        } else if let Some(like) = plain.columns.get(title) {
            let mut copy = like.clone();
            copy.values = column(table, at).collect();
            recording.columns.insert(title.clone(), copy);
        }
    }
    let folder = tempfile::tempdir().ok()?;
    let path = folder.path().join("log.parquet");
    let mut files = Files::default();
    formats::add_table(&mut files, &recording, &path).ok()?;
    files.commit().ok()?;
    std::fs::read(&path).ok()
}

/// Messages in JSON.
pub fn mcap(table: &Table) -> Option<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    {
        let mut writer = mcap::WriteOptions::new().create(&mut out).ok()?;
        let channel = writer.add_channel(0, TOPIC, "json", &std::collections::BTreeMap::new()).ok()?;
        for (sequence, (time, object)) in (0..).zip(objects(table)) {
            let nanos = (time * 1e9).round() as u64;
            let header =
                mcap::records::MessageHeader { channel_id: channel, sequence, log_time: nanos, publish_time: nanos };
            writer.write_to_known_channel(&header, object.as_bytes()).ok()?;
        }
        writer.finish().ok()?;
    }
    Some(out.into_inner())
}

/// A structured array.
pub fn npy(table: &Table) -> Vec<u8> {
    let fields: Vec<String> = table.titles.iter().map(|title| format!("('{title}', '<f8')")).collect();
    let mut header =
        format!("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}", fields.join(", "), table.rows.len());
    while (header.len() + 13) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header.bytes());
    let cells = table
        .rows
        .iter()
        .flat_map(|row| (0..table.titles.len()).map(|at| row.get(at).map_or(f64::NAN, |cell| number(cell))));
    bytes.extend(cells.flat_map(f64::to_le_bytes));
    bytes
}

/// An archive.
pub fn zip(files: impl IntoIterator<Item = (String, Vec<u8>)>) -> Option<Vec<u8>> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive.start_file(name, zip::write::SimpleFileOptions::default()).ok()?;
        archive.write_all(&bytes).ok()?;
    }
    Some(archive.finish().ok()?.into_inner())
}

/// A store of Zarr, version 2, with an array a column in chunks of 1024 rows.
pub fn zarr(table: &Table) -> Vec<(String, Vec<u8>)> {
    const ROWS: usize = 1024;
    let mut files = vec![(".zgroup".to_string(), br#"{"zarr_format": 2}"#.to_vec())];
    for (at, title) in table.titles.iter().enumerate() {
        let described = serde_json::json!({
            "zarr_format": 2, "shape": [table.rows.len()], "chunks": [ROWS], "dtype": "<f8", "compressor": null, "filters": null, "order": "C",
            "fill_value": 0.0,
        });
        files.push((format!("{title}/.zarray"), described.to_string().into_bytes()));
        let values: Vec<f64> = column(table, at).collect();
        files.extend(values.chunks(ROWS).enumerate().map(|(chunk, values)| {
            // A chunk is always whole.
            let filled = values.iter().copied().chain(std::iter::repeat_n(0.0, ROWS - values.len()));
            (format!("{title}/{chunk}"), filled.flat_map(f64::to_le_bytes).collect())
        }));
    }
    files
}

/// A bag of ROS 1, in chunks that are not compressed.
pub fn bag(table: &Table) -> Vec<u8> {
    const ROWS: usize = 256;
    let record = |fields: &[(&str, &[u8])], data: &[u8]| {
        let head: Vec<u8> = fields
            .iter()
            .flat_map(|(name, value)| {
                let length = (name.len() + 1 + value.len()) as u32;
                [&length.to_le_bytes()[..], name.as_bytes(), b"=", value].concat()
            })
            .collect();
        [&(head.len() as u32).to_le_bytes()[..], &head, &(data.len() as u32).to_le_bytes(), data].concat()
    };
    let definition: String =
        table.titles.iter().map(|title| format!("float64 {}\n", title.replace('.', BETWEEN))).collect();
    let connection: Vec<u8> = [("type", "damage/Row"), ("message_definition", &definition)]
        .iter()
        .flat_map(|(name, value)| {
            let field = format!("{name}={value}");
            [(field.len() as u32).to_le_bytes().to_vec(), field.into_bytes()].concat()
        })
        .collect();
    let id = 0_u32.to_le_bytes();
    let time = table.titles.iter().position(|title| title == "time");
    let mut bytes = b"#ROSBAG V2.0\n".to_vec();
    bytes.extend(record(&[("op", &[3])], &[b' '; 40]));
    for (at, rows) in table.rows.chunks(ROWS).enumerate() {
        let mut chunk = Vec::new();
        if at == 0 {
            chunk.extend(record(&[("op", &[7]), ("conn", &id), ("topic", TOPIC.as_bytes())], &connection));
        }
        for row in rows {
            let value = |at: usize| row.get(at).map_or(f64::NAN, |cell| number(cell));
            // A cast of NaN is zero.
            let nanos = (value(time.unwrap_or_default()) * 1e9) as u64;
            let stamp = [(nanos / 1_000_000_000) as u32, (nanos % 1_000_000_000) as u32].map(u32::to_le_bytes).concat();
            let data: Vec<u8> = (0..table.titles.len()).flat_map(|at| value(at).to_le_bytes()).collect();
            chunk.extend(record(&[("op", &[2]), ("conn", &id), ("time", &stamp)], &data));
        }
        let size = (chunk.len() as u32).to_le_bytes();
        bytes.extend(record(&[("op", &[5]), ("compression", b"none"), ("size", &size)], &chunk));
    }
    bytes
}
