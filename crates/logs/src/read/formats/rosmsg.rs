//! ROS messages: the text of a message definition and serialised messages in, named numbers and texts out.
//!
//! Definitions are those of `.msg` files with all that they name appended, as bags hold them. ROS 1 messages are packed, little endian;
//! ROS 2 messages are CDR, plain, of either version and byte order. A nested field is called by its path, `wrench.force.x`, and an element
//! of an array by its place, `poses[0].position.x`; arrays longer than [`MAX_ARRAY`] (images, point clouds) are skipped.
//!
//! Where a message says what its elements are called, the place is not a name, since it differs from message to message: joints are called
//! as in the array `name` beside them, `position.finger_joint`, and transforms by their child frame, `transforms.cube.transform`. A message in which a
//! name occurs twice is refused.

use crate::read::memory_table::InMemoryTable;
use std::collections::BTreeSet;
use std::ops::Range;
use teachtree_base::error::InputError;

/// The longest array that is spread into columns.
pub const MAX_ARRAY: usize = 64;
/// The longest definition that is read, in bytes.
const MAX_DEFINITION: usize = 1 << 20;
/// The deepest nesting of messages.
const MAX_DEPTH: usize = 32;

/// The field that names the frame of a transform.
const CHILD: &str = "child_frame_id";

/// The field of the bytes of a picture.
const DATA: &str = "data";

/// The serialization of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireFormat {
    /// ROS 1: packed, little endian.
    Ros1,
    /// ROS 2: CDR, with a header that says version and byte order.
    Cdr,
}

/// A message type with all types that it names.
#[derive(Clone, Debug)]
pub struct Definition {
    wire: WireFormat,
    /// The type itself is the first.
    types: Vec<Vec<Field>>,
}

#[derive(Clone, Debug)]
struct Field {
    name: String,
    kind: Kind,
    count: Count,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Bool,
    Unsigned(usize),
    Signed(usize),
    Float(usize),
    Text,
    WideText,
    /// Seconds and nanoseconds, four bytes each.
    Time,
    /// The type at this place of the list.
    Message(usize),
}

#[derive(Clone, Copy, Debug)]
enum Count {
    One,
    Fixed(usize),
    Sequence,
}

impl Definition {
    /// Reads a definition; `name` is that of the type, such as `geometry_msgs/msg/WrenchStamped`.
    ///
    /// # Errors
    /// The text of it that is not a definition.
    pub fn parse(name: &str, text: &str, wire: WireFormat) -> Result<Self, String> {
        if text.len() > MAX_DEFINITION {
            return Err(format!("its definition has {} bytes, at most {MAX_DEFINITION} are read", text.len()));
        }
        if text.lines().any(|line| line.trim() == "---") {
            return Err("its definition is that of a service or an action, expected a message".into());
        }
        let mut sections: Vec<(String, Vec<&str>)> = vec![(plain(name), vec![])];
        for line in text.lines().map(str::trim) {
            if line.len() > 2 && line.bytes().all(|byte| byte == b'=') {
                continue;
            }
            match (line.strip_prefix("MSG:"), sections.last_mut()) {
                (Some(name), _) => sections.push((plain(name), vec![])),
                (None, Some((_, lines))) => lines.push(line),
                (None, None) => {}
            }
        }
        let names: Vec<&str> = sections.iter().map(|(name, _)| name.as_str()).collect();
        let mut types = vec![];
        for (name, lines) in &sections {
            let mut fields = vec![];
            for line in lines {
                fields.extend(Field::parse(line, name, &names, wire)?);
            }
            types.push(fields);
        }
        Ok(Self { wire, types })
    }

    /// Puts the fields of a message into the last row; its stamp in nanoseconds, if it has a header with one.
    ///
    /// # Errors
    /// When the message is not of this type.
    pub fn decode(&self, message: &[u8], row: &mut InMemoryTable) -> Result<Option<i64>, Failure> {
        self.decode_with_bytes(message, row).map(|(stamp, _)| stamp)
    }

    /// The same, with the bytes in the field `data`, if it has more than [`MAX_ARRAY`].
    ///
    /// # Errors
    /// As [`decode`](Self::decode).
    pub fn decode_with_bytes<'m>(
        &self,
        message: &'m [u8],
        row: &mut InMemoryTable,
    ) -> Result<(Option<i64>, Option<&'m [u8]>), Failure> {
        let bytes = Bytes::new(message, self.wire).map_err(Failure::Message)?;
        let payload = bytes.data;
        let steps = message.len().saturating_mul(64).saturating_add(4096);
        let mut decoder = Decoder {
            types: &self.types,
            bytes,
            row,
            path: String::new(),
            muted: false,
            stamp: None,
            texts: vec![],
            steps,
            data: None,
        };
        decoder.message(0, 0)?;
        Ok((decoder.stamp, decoder.data.and_then(|place| payload.get(place))))
    }
}

/// Why a message could not be taken.
#[derive(Debug)]
pub enum Failure {
    /// It is not of its type: what was found.
    Message(String),
    /// The log grows too large.
    Log(InputError),
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Self::Message(message)
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Self::Log(error)
    }
}

/// `geometry_msgs/msg/Wrench` and `geometry_msgs/Wrench` are the same.
fn plain(name: &str) -> String {
    name.trim().replace("/msg/", "/")
}

impl Field {
    /// The field that a line declares, if it declares one.
    fn parse(line: &str, parent: &str, names: &[&str], wire: WireFormat) -> Result<Option<Self>, String> {
        let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
        let (Some(kind), Some(name)) = (words.next(), words.next()) else {
            return match line.split('#').next().map(str::trim) {
                None | Some("") => Ok(None),
                Some(found) => Err(format!("its definition has the line `{found}`, expected a type and a name")),
            };
        };
        if name.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
            return Ok(None); // A constant.
        }
        let (base, count) = match kind.split_once('[') {
            None => (kind, Count::One),
            Some((base, size)) => match size.strip_suffix(']') {
                Some(size) if size.is_empty() || size.starts_with("<=") => (base, Count::Sequence),
                Some(size) => {
                    (base, Count::Fixed(size.parse().map_err(|_| format!("its definition has the array `{kind}`"))?))
                }
                None => return Err(format!("its definition has the type `{kind}`")),
            },
        };
        let base = base.split_once("<=").map_or(base, |(base, _)| base);
        let kind = match base {
            "bool" => Kind::Bool,
            "byte" if wire == WireFormat::Ros1 => Kind::Signed(1),
            "byte" | "char" | "uint8" => Kind::Unsigned(1),
            "int8" => Kind::Signed(1),
            "uint16" => Kind::Unsigned(2),
            "int16" => Kind::Signed(2),
            "uint32" => Kind::Unsigned(4),
            "int32" => Kind::Signed(4),
            "uint64" => Kind::Unsigned(8),
            "int64" => Kind::Signed(8),
            "float32" => Kind::Float(4),
            "float64" => Kind::Float(8),
            "string" => Kind::Text,
            "wstring" => Kind::WideText,
            "time" | "duration" if wire == WireFormat::Ros1 => Kind::Time,
            _ => match plain(base).as_str() {
                "builtin_interfaces/Time" | "builtin_interfaces/Duration" => Kind::Time,
                base => Kind::Message(resolve(base, parent, names)?),
            },
        };
        Ok(Some(Self { name: name.to_string(), kind, count }))
    }
}

/// The place of a type by its name, which may lack the package.
fn resolve(base: &str, parent: &str, names: &[&str]) -> Result<usize, String> {
    let package = parent.split_once('/').map_or("", |(package, _)| package);
    let full = [base.to_string(), format!("{package}/{base}"), format!("std_msgs/{base}")];
    let ending = format!("/{base}");
    full.iter()
        .find_map(|name| names.iter().position(|known| known == name))
        .or_else(|| names.iter().position(|known| known.ends_with(&ending)))
        .ok_or_else(|| format!("its definition names the type `{base}` and does not define it"))
}

/// The names of array elements in a message.
#[derive(Default)]
struct Names {
    /// The names in their order; none if an element has no name.
    all: Vec<String>,
    /// A name that two elements have.
    twice: Option<String>,
}

impl Names {
    fn of(texts: &[String]) -> Self {
        if texts.iter().any(String::is_empty) {
            return Self::default();
        }
        let mut seen = BTreeSet::new();
        let twice = texts.iter().find(|name| !seen.insert(*name)).cloned();
        Self { all: texts.to_vec(), twice }
    }
}

/// The error for an element that occurs twice in a message: its value is ambiguous.
fn twice(path: &str) -> Failure {
    Failure::Message(format!("`{path}` occurs twice"))
}

/// A message on its way into a row.
struct Decoder<'a> {
    types: &'a [Vec<Field>],
    bytes: Bytes<'a>,
    row: &'a mut InMemoryTable,
    path: String,
    /// Whether the current values are skipped.
    muted: bool,
    /// The stamp of the first header, ns.
    stamp: Option<i64>,
    /// The texts of the field that is read, where they are kept.
    texts: Vec<String>,
    /// Remaining number of values that may be read: definitions can nest empty arrays.
    steps: usize,
    /// The range of the bytes of the field `data`.
    data: Option<Range<usize>>,
}

impl Decoder<'_> {
    fn message(&mut self, kind: usize, depth: usize) -> Result<(), Failure> {
        if depth > MAX_DEPTH {
            return Err(format!("its definition is nested more than {MAX_DEPTH} deep").into());
        }
        let types = self.types;
        let Some(fields) = types.get(kind) else { return Ok(()) };
        if fields.is_empty() && self.bytes.wire == WireFormat::Cdr {
            // CDR knows no empty structure.
            self.bytes.take::<1>()?;
        }
        // The fields before the child frame of an element wait for its name.
        let names_itself = self.path.ends_with(']') && fields.iter().any(|field| field.name == CHILD);
        let muted = self.muted;
        self.muted |= names_itself;
        let (mut names, mut parent) = (Names::default(), None);
        for field in fields {
            let length = self.path.len();
            if length > 0 {
                self.path.push('.');
            }
            self.path.push_str(&field.name);
            let says_names = field.name == "name" && matches!((field.kind, field.count), (Kind::Text, Count::Sequence));
            if says_names || names_itself && self.muted {
                self.texts.clear();
            }
            let before = self.muted;
            self.muted |= says_names;
            self.field(field, depth, &names)?;
            self.muted = before;
            self.path.truncate(length);
            if says_names {
                names = Names::of(&self.texts);
            }
            if names_itself && field.name == "header" {
                parent = self.texts.last().cloned();
            }
            if names_itself && field.name == CHILD {
                self.muted = muted;
                self.path.truncate(self.path.rfind('[').unwrap_or(length));
                self.path.push_str(&format!(".{}", self.texts.last().map_or("?", String::as_str)));
                if let (false, Some(parent)) = (self.muted, parent.take())
                    && !self.row.put_text(&format!("{}.header.frame_id", self.path), &parent)?
                {
                    return Err(twice(&self.path));
                }
            }
        }
        self.muted = muted;
        Ok(())
    }

    /// Reads a field; its elements have these `names`, if they are as many.
    fn field(&mut self, field: &Field, depth: usize, names: &Names) -> Result<(), Failure> {
        let count = match field.count {
            Count::One => return self.value(field.kind, depth),
            Count::Fixed(count) => count,
            Count::Sequence => self.bytes.length()?,
        };
        if count > self.bytes.left() {
            return Err(
                format!("`{}` declares {count} elements, and {} bytes are left", self.path, self.bytes.left()).into()
            );
        }
        let muted = self.muted;
        self.muted |= count > MAX_ARRAY;
        if let (false, Some(name)) = (self.muted || names.all.len() != count, &names.twice) {
            return Err(twice(&format!("{}.{name}", self.path)));
        }
        if let (true, Kind::Bool | Kind::Unsigned(1) | Kind::Signed(1)) = (self.muted, field.kind) {
            let start = self.bytes.at;
            self.bytes.skip(count)?;
            if self.path == DATA {
                self.data = Some(start..self.bytes.at);
            }
        } else {
            let length = self.path.len();
            for place in 0..count {
                match names.all.get(place).filter(|_| names.all.len() == count) {
                    _ if self.muted => {}
                    Some(name) => self.path.push_str(&format!(".{name}")),
                    None => self.path.push_str(&format!("[{place}]")),
                }
                self.value(field.kind, depth)?;
                self.path.truncate(length);
            }
        }
        self.muted = muted;
        Ok(())
    }

    fn value(&mut self, kind: Kind, depth: usize) -> Result<(), Failure> {
        self.steps = self
            .steps
            .checked_sub(1)
            .ok_or_else(|| "its definition has more values than a message can hold".to_string())?;
        let number = match kind {
            Kind::Bool => f64::from(u8::from(self.bytes.unsigned(1)? != 0)),
            Kind::Unsigned(size) => self.bytes.unsigned(size)? as f64,
            Kind::Signed(size) => self.bytes.signed(size)? as f64,
            Kind::Float(4) => f64::from(f32::from_bits(self.bytes.unsigned(4)? as u32)),
            Kind::Float(_) => f64::from_bits(self.bytes.unsigned(8)?),
            Kind::Time => return self.time(),
            Kind::Text | Kind::WideText => {
                let text = if matches!(kind, Kind::Text) { self.bytes.text()? } else { self.bytes.wide_text()? };
                if !self.muted && !self.row.put_text(&self.path, &text)? {
                    return Err(twice(&self.path));
                }
                self.texts.push(text);
                return Ok(());
            }
            Kind::Message(kind) => return self.message(kind, depth + 1),
        };
        if !self.muted && !self.row.put(&self.path, if number.is_finite() { number } else { f64::NAN })? {
            return Err(twice(&self.path));
        }
        Ok(())
    }

    fn time(&mut self) -> Result<(), Failure> {
        const NANOS: i64 = 1_000_000_000;
        // ROS 1 counts seconds without sign and ROS 2 with one; they agree until 2038.
        let seconds =
            if self.bytes.wire == WireFormat::Ros1 { self.bytes.unsigned(4)? as i64 } else { self.bytes.signed(4)? };
        let nanos = self.bytes.unsigned(4)? as i64;
        // Messages of Foxglove have no header.
        if self.path.ends_with("header.stamp") || self.path == "timestamp" {
            // A zero stamp was not set.
            self.stamp = self.stamp.or(Some(seconds * NANOS + nanos).filter(|stamp| *stamp != 0));
        }
        if self.path != "header.stamp" && !self.muted {
            let length = self.path.len();
            self.path.push_str(" [s]");
            self.row.put(&self.path, seconds as f64 + nanos as f64 / NANOS as f64)?;
            self.path.truncate(length);
        }
        Ok(())
    }
}

/// The bytes of a message while they are read.
struct Bytes<'a> {
    data: &'a [u8],
    at: usize,
    wire: WireFormat,
    big_endian: bool,
    /// The coarsest grid on which CDR puts values.
    grid: usize,
}

impl<'a> Bytes<'a> {
    fn new(message: &'a [u8], wire: WireFormat) -> Result<Self, String> {
        if wire == WireFormat::Ros1 {
            return Ok(Self { data: message, at: 0, wire, big_endian: false, grid: 1 });
        }
        let [kind0, kind1, _, _, data @ ..] = message else {
            return Err(format!("found a message of {} bytes, expected CDR with its header of 4", message.len()));
        };
        let (big_endian, grid) = match (kind0, kind1) {
            (0, 0) => (true, 8),
            (0, 1) => (false, 8),
            (0, 6) => (true, 4),
            (0, 7) => (false, 4),
            (a, b) => {
                return Err(format!(
                    "found CDR of the kind {a:02x} {b:02x}, expected plain CDR (00 00, 00 01, 00 06, 00 07)"
                ));
            }
        };
        Ok(Self { data, at: 0, wire, big_endian, grid })
    }

    fn left(&self) -> usize {
        self.data.len().saturating_sub(self.at)
    }

    fn skip(&mut self, count: usize) -> Result<(), String> {
        if count > self.left() {
            return Err(format!("the message ends after {} bytes", self.data.len()));
        }
        self.at += count;
        Ok(())
    }

    fn slice(&mut self, count: usize) -> Result<&'a [u8], String> {
        let start = self.at;
        self.skip(count)?;
        Ok(self.data.get(start..self.at).unwrap_or_default())
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.slice(N)?.try_into().map_err(|_| "the message ends too early".to_string())
    }

    /// A number of this many bytes, on its grid.
    fn unsigned(&mut self, size: usize) -> Result<u64, String> {
        if self.wire == WireFormat::Cdr {
            let grid = size.min(self.grid).max(1);
            self.skip((grid - self.at % grid) % grid)?;
        }
        let add = |number: u64, byte: &u8| (number << 8) | u64::from(*byte);
        let bytes = self.slice(size)?;
        Ok(if self.big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) })
    }

    fn signed(&mut self, size: usize) -> Result<i64, String> {
        let shift = 64 - 8 * size.clamp(1, 8);
        Ok(((self.unsigned(size)? << shift) as i64) >> shift)
    }

    fn length(&mut self) -> Result<usize, String> {
        Ok(usize::try_from(self.unsigned(4)?).unwrap_or(usize::MAX))
    }

    fn text(&mut self) -> Result<String, String> {
        let length = self.length()?;
        let bytes = self.slice(length)?;
        // CDR counts the zero that ends a text.
        let bytes = if self.wire == WireFormat::Cdr { bytes.strip_suffix(&[0]).unwrap_or(bytes) } else { bytes };
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }

    fn wide_text(&mut self) -> Result<String, String> {
        let length = self.length()?;
        if length > self.left() {
            return Err(format!("a string declares {length} bytes, and {} are left", self.left()));
        }
        let mut letters = vec![];
        for _ in 0..length {
            letters.push(self.unsigned(2)? as u16);
        }
        Ok(String::from_utf16_lossy(&letters))
    }
}
