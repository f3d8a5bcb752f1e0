//! Checks the sizes in a page header: the uncompressed length, and the number of values of a dictionary. The library allocates memory for both before it
//! reads the data.
//!
//! The header is a `PageHeader` in Thrift's compact protocol (parquet.thrift; thrift-compact-protocol.md). Each field has a byte with the increment of the
//! field number and the type, followed by the value.

/// Field numbers of a header: the uncompressed length, and the dictionary header, whose first field is the number of values.
const UNPACKED: u64 = 2;
const DICTIONARY: u64 = 7;
/// Types of fields.
const I32: u8 = 5;
const STRUCT: u8 = 12;

/// Rejects a header that declares a page of more than `most` bytes, or a dictionary with more values than its page has bytes. Accepts bytes that are
/// not a header.
///
/// # Errors
/// The declared size is too large.
pub fn check(head: &[u8], most: u64) -> Result<(), String> {
    let (mut rest, mut field, mut unpacked) = (head, 0, 0);
    while let Some(kind) = next(&mut rest, &mut field) {
        match (field, kind) {
            (DICTIONARY, STRUCT) => {
                let values = match next(&mut rest, &mut 0) {
                    Some(I32) => number(&mut rest).unwrap_or(0),
                    _ => 0,
                };
                if values > unpacked {
                    return Err(format!("a dictionary declares {values} values in {unpacked} bytes"));
                }
                return Ok(());
            }
            (_, I32) => {
                let Some(value) = number(&mut rest) else { return Ok(()) };
                if field == UNPACKED {
                    unpacked = value;
                }
                if unpacked > most {
                    return Err(format!(
                        "a page declares {unpacked} uncompressed bytes, expected at most {most} in a file of this size"
                    ));
                }
            }
            // The length precedes fields of all other types.
            _ => return Ok(()),
        }
    }
    Ok(())
}

/// Returns the type of the next field and advances `field` to its number; `None` at the end.
fn next(rest: &mut &[u8], field: &mut u64) -> Option<u8> {
    let (byte, after) = rest.split_first()?;
    let step = u64::from(byte >> 4);
    // A field without an increment contains its number. Page headers do not use this form.
    if *byte == 0 || step == 0 {
        return None;
    }
    (*rest, *field) = (after, *field + step);
    Some(byte & 15)
}

/// Reads a zigzag varint. Negative numbers count as 0.
fn number(rest: &mut &[u8]) -> Option<u64> {
    let length = rest.iter().take(5).position(|byte| byte & 128 == 0)? + 1;
    let (bytes, after) = rest.split_at_checked(length)?;
    *rest = after;
    let value = bytes.iter().rev().fold(0_u64, |value, byte| value << 7 | u64::from(byte & 127));
    Some(if value & 1 == 0 { value >> 1 } else { 0 })
}
