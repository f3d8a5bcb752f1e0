//! Bags that tests write.

use mcap::{Compression, WriteOptions, Writer, records::MessageHeader};
use std::collections::BTreeMap;
use std::path::Path;

/// A topic: name, encoding, type, definition, and its messages with the time at which each was recorded, s.
pub type Topic<'a> = (&'a str, &'a str, &'a str, &'a str, Vec<(f64, Vec<u8>)>);

pub fn write(path: &Path, compression: Option<Compression>, topics: &[Topic]) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut writer =
        WriteOptions::new().chunk_size(Some(256)).compression(compression).profile("ros2").create(file).unwrap();
    for (topic, encoding, kind, definition, messages) in topics {
        let schema = match definition.is_empty() {
            true => 0,
            false => writer.add_schema(kind, "ros2msg", definition.as_bytes()).unwrap(),
        };
        let channel = writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap();
        for (recorded, data) in messages {
            let time = (recorded * 1e9) as u64;
            let header = MessageHeader { channel_id: channel, sequence: 0, log_time: time, publish_time: time };
            writer.write_to_known_channel(&header, data).unwrap();
        }
    }
    finish(writer);
}

pub fn finish<W: std::io::Write + std::io::Seek>(mut writer: Writer<W>) {
    writer.finish().unwrap();
}

/// Transforms as ROS defines them.
pub const TRANSFORMS: &str = "geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Vector3 translation
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
";

/// The state of joints as ROS defines it, without header and effort.
pub const JOINT_STATE: &str = "string[] name
float64[] position
";

/// CDR, little endian, written value by value.
#[derive(Default)]
pub struct Cdr(Vec<u8>);

impl Cdr {
    fn put(mut self, bytes: &[u8]) -> Self {
        self.0.resize(self.0.len().next_multiple_of(bytes.len()), 0);
        self.0.extend(bytes);
        self
    }

    fn u32(self, value: u32) -> Self {
        self.put(&value.to_le_bytes())
    }

    fn f64(self, value: f64) -> Self {
        self.put(&value.to_le_bytes())
    }

    fn text(self, text: &str) -> Self {
        let mut cdr = self.u32(text.len() as u32 + 1);
        cdr.0.extend(text.as_bytes());
        cdr.0.push(0);
        cdr
    }

    fn message(self) -> Vec<u8> {
        [vec![0, 1, 0, 0], self.0].concat()
    }
}

/// The stamp is in half seconds.
pub fn transforms(halves: u32, of: &[(&str, f64)]) -> Vec<u8> {
    let begin = Cdr::default().u32(of.len() as u32);
    let put = |cdr: Cdr, (child, x): &(&str, f64)| {
        cdr.u32(halves / 2).u32(halves % 2 * 500_000_000).text("world").text(child).f64(*x).f64(0.0).f64(0.5)
    };
    of.iter().fold(begin, put).message()
}

pub fn joint_state(of: &[(&str, f64)]) -> Vec<u8> {
    let names = of.iter().fold(Cdr::default().u32(of.len() as u32), |cdr, (name, _)| cdr.text(name));
    of.iter().fold(names.u32(of.len() as u32), |cdr, (_, position)| cdr.f64(*position)).message()
}
