//! Detects duplicate keys of a mapping anywhere in a text. Deserializing into a map would silently keep the last one.

use crate::yaml::MAX_BYTES;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IgnoredAny, MapAccess, SeqAccess, VariantAccess, Visitor,
};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::fmt;

/// The begin and end of this search's errors.
const DUPLICATE: [&str; 2] = ["the key `", "occurs twice"];
const TOO_LARGE: [&str; 2] = ["the text", "its aliases are written out"];
/// Limit of the number of values; a text without aliases has fewer.
const MAX_VALUES: usize = MAX_BYTES;

/// Returns the message of an error of this search without the place that the crate adds; `None` for other errors, which deserializing into types
/// reports.
pub(super) fn message_of(message: &str) -> Option<&str> {
    let between = |[begins, ends]: [&str; 2]| message.get(message.find(begins)?..message.find(ends)? + ends.len());
    between(DUPLICATE).or_else(|| between(TOO_LARGE))
}

/// The search.
pub(super) fn search<'de, D: Deserializer<'de>>(text: D) -> Result<(), D::Error> {
    UniqueKeys(&Cell::new(0)).deserialize(text)
}

/// Visits all values, and stops at the first duplicate key.
#[derive(Clone, Copy)]
struct UniqueKeys<'s>(&'s Cell<usize>);

impl<'de> DeserializeSeed<'de> for UniqueKeys<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        self.0.set(self.0.get() + 1);
        if self.0.get() > MAX_VALUES {
            return Err(D::Error::custom(format!(
                "{} has more than {MAX_VALUES} values when {}",
                TOO_LARGE[0], TOO_LARGE[1]
            )));
        }
        from.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for UniqueKeys<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("anything")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut seen = BTreeSet::new();
        while map.next_key_seed(UniqueKey(&mut seen))?.is_some() {
            map.next_value_seed(self)?;
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        while items.next_element_seed(self)?.is_some() {}
        Ok(())
    }

    fn visit_enum<A: EnumAccess<'de>>(self, tagged: A) -> Result<(), A::Error> {
        let (IgnoredAny, value) = tagged.variant()?;
        value.newtype_variant_seed(self)
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_u64<E>(self, _: u64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }
}

/// The keys of a mapping so far. Reads a key, and stops at a duplicate.
struct UniqueKey<'s>(&'s mut BTreeSet<String>);

impl<'de> DeserializeSeed<'de> for UniqueKey<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        from.deserialize_str(self)
    }
}

impl<'de> Visitor<'de> for UniqueKey<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<(), E> {
        if self.0.insert(key.into()) {
            Ok(())
        } else {
            Err(E::custom(format!("{}{key}` {}", DUPLICATE[0], DUPLICATE[1])))
        }
    }
}
