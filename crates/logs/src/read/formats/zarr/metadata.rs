//! The metadata of groups and arrays: `.zarray` and `.zattrs` of version 2, `zarr.json` of version 3.

use super::super::elements::Element;
use super::chunks::ChunkedArray;
use super::codecs::{Codec, DimensionOrder};
use super::shards::Shards;
use super::store::Store;
use serde_json::{Map, Value};
use std::rc::Rc;
use teachtree_base::error::InputError;
use teachtree_base::json;

/// An array as it describes itself.
pub(super) enum ArrayMetadata {
    /// One that can be read.
    Array(Box<ChunkedArray>),
    /// One that cannot be read.
    Refused { rows: usize, dimensions: Vec<usize>, reason: String },
}

/// The files that describe the group or array of a path.
pub(super) fn keys(path: &str) -> Vec<String> {
    ["zarr.json", ".zgroup", ".zarray", ".zattrs"].map(|file| key(path, file)).to_vec()
}

/// A file of the group or array of a path.
fn key(path: &str, file: &str) -> String {
    if path.is_empty() { file.to_string() } else { format!("{path}/{file}") }
}

/// A JSON file, if it is there.
fn file(store: &Store, place: &str, key: &str) -> Result<Option<Value>, InputError> {
    let Some(bytes) = store.description(key)? else { return Ok(None) };
    let place = format!("{place} file {key}");
    let text = String::from_utf8(bytes).map_err(|_| InputError::new(&place, "is not valid UTF-8"))?;
    json::read(&text, &place).map(Some)
}

/// Whether `zarr.json` describes an array, not a group.
pub(super) fn is_array(store: &Store, path: &str) -> Result<bool, InputError> {
    let described = file(store, "", &key(path, "zarr.json"))?;
    Ok(described.is_some_and(|described| text(&described, "node_type") == Some("array")))
}

/// The attributes of the group or array of a path.
pub(super) fn attributes(store: &Store, place: &str, path: &str) -> Result<Map<String, Value>, InputError> {
    let of_2 = file(store, place, &key(path, ".zattrs"))?;
    let found = match of_2 {
        Some(found) => Some(found),
        None => {
            file(store, place, &key(path, "zarr.json"))?.and_then(|mut all| Some(all.get_mut("attributes")?.take()))
        }
    };
    Ok(match found {
        Some(Value::Object(found)) => found,
        _ => Map::new(),
    })
}

/// Reads the description of the array of a path.
pub(super) fn read(store: &Rc<Store>, place: &str, path: &str) -> Result<ArrayMetadata, InputError> {
    let (at, of_2) = (key(path, "zarr.json"), key(path, ".zarray"));
    let wrong = |message: String| InputError::new(format!("{place} array {path}"), message);
    let (described, version) = match file(store, place, &of_2)? {
        Some(described) => (described, 2),
        None => (file(store, place, &at)?.ok_or_else(|| wrong("is not described".into()))?, 3),
    };
    let shape = sizes(described.get("shape")).ok_or_else(|| wrong("has no `shape`, a list of whole numbers".into()))?;
    let Some((rows, dimensions)) = shape.split_first() else {
        return Ok(ArrayMetadata::Refused { rows: 0, dimensions: vec![], reason: "is a single value".into() });
    };
    let refused = |reason| ArrayMetadata::Refused { rows: *rows, dimensions: dimensions.to_vec(), reason };
    let layout = if version == 2 { version_2(&described) } else { version_3(&described) };
    let layout = match layout {
        Ok(layout) => layout,
        Err(reason) => return Ok(refused(reason)),
    };
    if layout.chunk.len() != shape.len() || layout.chunk.contains(&0) {
        return Ok(refused(format!(
            "has chunks of the shape {:?}, expected that of {} dimensions",
            layout.chunk,
            shape.len()
        )));
    }
    if let DimensionOrder::Transposed(order) = &layout.order
        && !(0..shape.len()).all(|at| order.iter().filter(|of| **of == at).count() == 1 && order.len() == shape.len())
    {
        return Ok(refused(format!("has the order {order:?} of {} dimensions", shape.len())));
    }
    Ok(ArrayMetadata::Array(Box::new(ChunkedArray::new(Rc::clone(store), place, path, shape, layout))))
}

/// The storage of an array's values.
pub(super) struct Layout {
    /// The shape of a chunk.
    pub chunk: Vec<usize>,
    pub element: Element,
    /// The fill value of missing chunks.
    pub fill: f64,
    /// In which order the dimensions of a chunk are stored.
    pub order: DimensionOrder,
    /// The codecs of a chunk, in the order of encoding.
    pub codecs: Vec<Codec>,
    /// The files that chunks are in, where these have several chunks.
    pub shards: Option<Shards>,
    /// The prefix of a chunk's file name, and the separator of its numbers.
    pub prefix: &'static str,
    pub separator: char,
}

fn version_2(described: &Value) -> Result<Layout, String> {
    let dtype = described.get("dtype").unwrap_or(&Value::Null);
    let name = dtype.as_str().ok_or_else(|| match dtype {
        Value::Array(_) => "has structured elements, which are not read".to_string(),
        _ => "has no `dtype`".to_string(),
    })?;
    if let Some(filter) = described.get("filters").and_then(Value::as_array).and_then(|filters| filters.first()) {
        return Err(format!("went through the filter `{}`, which is not read here", text(filter, "id").unwrap_or("?")));
    }
    let compressor = described.get("compressor").filter(|compressor| !compressor.is_null());
    let named = |compressor| Codec::read(text(compressor, "id").unwrap_or("?"), text(compressor, "cname"));
    let codec = compressor.map(named).transpose()?;
    let separator = match text(described, "dimension_separator") {
        Some("/") => '/',
        _ => '.',
    };
    Ok(Layout {
        chunk: sizes(described.get("chunks")).ok_or("has no `chunks`, a list of whole numbers")?,
        element: Element::of_zarr_2(name)?,
        fill: fill(described),
        order: if text(described, "order") == Some("F") {
            DimensionOrder::ColumnMajor
        } else {
            DimensionOrder::RowMajor
        },
        codecs: codec.into_iter().collect(),
        shards: None,
        prefix: "",
        separator,
    })
}

/// A value of the configuration of a codec or a grid.
fn configuration(of: &Value, key: &str) -> Option<Value> {
    of.get("configuration").and_then(|of| of.get(key)).cloned()
}

/// The name of a codec or a grid.
fn named(of: &Value) -> String {
    match of {
        Value::String(name) => name.clone(),
        other => text(other, "name").unwrap_or("?").to_string(),
    }
}

/// Returns the codecs of a chunk, in the order of encoding.
struct CodecChain {
    order: DimensionOrder,
    codecs: Vec<Codec>,
    big_endian: bool,
    /// The codec that puts chunks into shards.
    sharding: Option<Value>,
}

impl CodecChain {
    fn read(list: Option<&Value>) -> Result<Self, String> {
        let mut chain = Self { order: DimensionOrder::RowMajor, codecs: vec![], big_endian: false, sharding: None };
        for codec in list.and_then(Value::as_array).ok_or("has no `codecs`")? {
            match named(codec).as_str() {
                "bytes" => chain.big_endian = configuration(codec, "endian").is_some_and(|endian| endian == "big"),
                "transpose" => {
                    let of = configuration(codec, "order");
                    let order = sizes(of.as_ref()).ok_or("is transposed, without an `order`")?;
                    chain.order = DimensionOrder::Transposed(order);
                }
                "sharding_indexed" => chain.sharding = Some(codec.clone()),
                name => {
                    let packer = configuration(codec, "cname");
                    let packer = packer.as_ref().and_then(Value::as_str);
                    chain.codecs.push(Codec::read(name.strip_prefix("numcodecs.").unwrap_or(name), packer)?);
                }
            }
        }
        Ok(chain)
    }

    /// The shape of the chunks in shards of this shape, the codecs of chunks, and the shards.
    fn of_shards(self, sharding: &Value, shape: Vec<usize>) -> Result<(Vec<usize>, Self, Shards), String> {
        let inner = Self::read(configuration(sharding, "codecs").as_ref())?;
        let index = Self::read(configuration(sharding, "index_codecs").as_ref())?;
        if self.order != DimensionOrder::RowMajor || inner.sharding.is_some() {
            return Err("is in shards that are transposed or in shards themselves, which are not read here".into());
        }
        let has_sum = match index.codecs.as_slice() {
            [] => false,
            [Codec::Crc32c] => true,
            _ => return Err("is in shards with a packed index, which is not read here".into()),
        };
        if index.big_endian {
            return Err("is in shards with a big-endian index, which is not read here".into());
        }
        let chunk =
            sizes(configuration(sharding, "chunk_shape").as_ref()).ok_or("is in shards without `chunk_shape`")?;
        let fits = chunk.len() == shape.len()
            && shape.iter().zip(&chunk).all(|(shard, chunk)| *chunk > 0 && *shard > 0 && shard % chunk == 0);
        if !fits {
            return Err(format!("has shards of the shape {shape:?}, expected multiples of its chunks, {chunk:?}"));
        }
        let index_at_start = configuration(sharding, "index_location").is_some_and(|location| location == "start");
        Ok((chunk, inner, Shards { shape, index_at_start, has_sum, codecs: self.codecs }))
    }
}

fn version_3(described: &Value) -> Result<Layout, String> {
    let grid = described.get("chunk_grid").unwrap_or(&Value::Null);
    if named(grid) != "regular" {
        return Err(format!("has a chunk grid `{}`, expected `regular`", named(grid)));
    }
    let shape = sizes(configuration(grid, "chunk_shape").as_ref()).ok_or("has no `chunk_shape`")?;
    let chain = CodecChain::read(described.get("codecs"))?;
    let (chunk, chain, shards) = match chain.sharding.clone() {
        Some(sharding) => {
            let (chunk, inner, shards) = chain.of_shards(&sharding, shape)?;
            (chunk, inner, Some(shards))
        }
        None => (shape, chain, None),
    };
    let encoding = described.get("chunk_key_encoding").unwrap_or(&Value::Null);
    let prefix = if named(encoding) == "v2" { "" } else { "c" };
    let usual = if prefix.is_empty() { '.' } else { '/' };
    let separator = configuration(encoding, "separator");
    let separator = separator.as_ref().and_then(Value::as_str).and_then(|text| text.chars().next()).unwrap_or(usual);
    let kind = described.get("data_type").map(named).unwrap_or_default();
    Ok(Layout {
        chunk,
        element: Element::of_zarr_3(&kind, chain.big_endian)?,
        fill: fill(described),
        order: chain.order,
        codecs: chain.codecs,
        shards,
        prefix,
        separator,
    })
}

/// Returns the fill value; NaN by default.
fn fill(described: &Value) -> f64 {
    match described.get("fill_value") {
        Some(Value::Number(number)) => number.as_f64().unwrap_or(f64::NAN),
        Some(Value::Bool(value)) => f64::from(u8::from(*value)),
        _ => f64::NAN,
    }
}

fn text<'a>(of: &'a Value, key: &str) -> Option<&'a str> {
    of.get(key).and_then(Value::as_str)
}

fn sizes(of: Option<&Value>) -> Option<Vec<usize>> {
    let size = |value: &Value| usize::try_from(value.as_u64()?).ok();
    of?.as_array()?.iter().map(size).collect()
}
