//! The numbers of schemas and channels in files that become one: equal ones get one number, and others that have the same one get another.

use super::{CHANNEL, CHUNK, Fault, Fields, MESSAGE, SCHEMA, decompressed, record};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};

/// A record: its kind and its bytes.
pub(super) type Record = (u8, Vec<u8>);

/// Schemas or channels, each with its bytes after the number.
pub(super) type Numbered = BTreeMap<u16, Vec<u8>>;

/// The new numbers of a file, by the old ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Renumbering {
    schemas: BTreeMap<u16, u16>,
    channels: BTreeMap<u16, u16>,
}

impl Renumbering {
    /// Takes a schema of the file; `all` has those of the files before.
    ///
    /// # Errors
    /// No number is left.
    pub fn schema(&mut self, number: u16, bytes: &[u8], all: &mut Numbered) -> Result<(), String> {
        if let Entry::Vacant(place) = self.schemas.entry(number) {
            place.insert(numbered(number, bytes.to_vec(), all, 1)?);
        }
        Ok(())
    }

    /// Takes a channel of the file, likewise. Its bytes begin with the number of its schema.
    ///
    /// # Errors
    /// No number is left.
    pub fn channel(&mut self, number: u16, bytes: &[u8], all: &mut Numbered) -> Result<(), String> {
        if !self.channels.contains_key(&number) {
            let bytes = self.with_schema(bytes);
            self.channels.insert(number, numbered(number, bytes, all, 0)?);
        }
        Ok(())
    }

    /// Whether all numbers stay.
    pub fn is_identity(&self) -> bool {
        self.schemas.iter().chain(&self.channels).all(|(old, new)| old == new)
    }

    /// The bytes of a channel with the new number of its schema.
    fn with_schema(&self, bytes: &[u8]) -> Vec<u8> {
        let Some((number, rest)) = bytes.split_first_chunk::<2>() else { return bytes.to_vec() };
        let old = u16::from_le_bytes(*number);
        let new = self.schemas.get(&old).copied().unwrap_or(old);
        [&new.to_le_bytes()[..], rest].concat()
    }

    /// A record with new numbers, the records in it if it is a chunk.
    ///
    /// # Errors
    /// The chunk is damaged.
    pub fn renumbered(&self, (kind, body): Record, into: &mut VecDeque<Record>) -> Result<(), Fault> {
        if kind == CHUNK {
            let plain = decompressed(&body)?;
            let mut rest = plain.as_slice();
            loop {
                match record(&mut rest) {
                    Ok(Some(inner)) => into.push_back(self.renumbered_one(inner)?),
                    Ok(None) | Err(Fault::Truncated) => return Ok(()),
                    Err(fault) => return Err(fault),
                }
            }
        }
        into.push_back(self.renumbered_one((kind, body))?);
        Ok(())
    }

    fn renumbered_one(&self, (kind, body): Record) -> Result<Record, Fault> {
        if !matches!(kind, SCHEMA | CHANNEL | MESSAGE) {
            return Ok((kind, body));
        }
        let mut fields = Fields(&body);
        let old = fields.u16()?;
        let numbers = if kind == SCHEMA { &self.schemas } else { &self.channels };
        let new = numbers.get(&old).copied().unwrap_or(old);
        let rest = if kind == CHANNEL { self.with_schema(fields.0) } else { fields.0.to_vec() };
        Ok((kind, [&new.to_le_bytes()[..], &rest].concat()))
    }
}

/// The number of a schema or channel among all: that of an equal one, else its own, else the first one from `least` on that is free.
fn numbered(number: u16, bytes: Vec<u8>, all: &mut Numbered, least: u16) -> Result<u16, String> {
    let is_equal = |(_, known): &(&u16, &Vec<u8>)| **known == bytes;
    if let Some((known, _)) = all.iter().find(is_equal) {
        return Ok(*known);
    }
    let is_free = |number: &u16| !all.contains_key(number);
    let own = Some(number).filter(is_free);
    let new = own.or_else(|| (least..=u16::MAX).find(is_free));
    let new = new.ok_or_else(|| "its files have more than 65536 schemas or channels".to_string())?;
    all.insert(new, bytes);
    Ok(new)
}
