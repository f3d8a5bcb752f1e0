//! The schema of Arrow that writers put into the metadata of Parquet files: fixed sizes of lists, names, metadata of fields. Readers of Arrow prefer it
//! to what they would derive from the columns, so it has to describe the columns that are there.

use arrow_ipc::convert::try_schema_from_ipc_buffer;
use arrow_ipc::writer::{DictionaryTracker, IpcDataGenerator, IpcWriteOptions};
use arrow_schema::{Field, FieldRef, Schema};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::sync::Arc;

/// The key of the metadata.
pub(super) const KEY: &str = "ARROW:schema";

/// The schema with these fields instead of those of the same names, after the others, and with this metadata instead of that of the same keys, where
/// it has some. `None` for a text that is not a schema.
pub(super) fn updated(encoded: &str, fields: &[Field], metadata: &[(String, String)]) -> Option<String> {
    let bytes = STANDARD.decode(encoded).ok()?;
    let schema = try_schema_from_ipc_buffer(&bytes).ok()?;
    let is_new = |field: &&FieldRef| !fields.iter().any(|new| new.name() == field.name());
    let mut all: Vec<FieldRef> = schema.fields().iter().filter(is_new).cloned().collect();
    all.extend(fields.iter().cloned().map(Arc::new));
    let mut own = schema.metadata().clone();
    for (key, value) in metadata {
        if own.contains_key(key) {
            own.insert(key, value);
        }
    }
    Some(encoded_schema(&Schema::new_with_metadata(all, own)))
}

fn encoded_schema(schema: &Schema) -> String {
    let mut tracker = DictionaryTracker::new(true);
    let message = IpcDataGenerator::default()
        .schema_to_bytes_with_dictionary_tracker(schema, &mut tracker, &IpcWriteOptions::default())
        .ipc_message;
    let mut bytes = vec![0xff; 4];
    bytes.extend(u32::try_from(message.len()).unwrap_or(u32::MAX).to_le_bytes());
    bytes.extend(message);
    STANDARD.encode(bytes)
}
