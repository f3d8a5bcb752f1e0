//! What the head of a page promises: how long it is when it is unpacked, and how many values a dictionary has. The library takes the memory for both before
//! it sees them.
//!
//! A head is a `PageHeader` in Thrift's compact protocol (parquet.thrift; thrift-compact-protocol.md): for each field a byte with the step of its number and
//! its type, and its value.

/// Fields of a head: the length when it is unpacked, and the head of a dictionary, whose first field is the number of values.
const UNPACKED: u64 = 2;
const DICTIONARY: u64 = 7;
/// Types of fields.
const I32: u8 = 5;
const STRUCT: u8 = 12;

/// Refuses a head that promises a page of more than `most` bytes, or a dictionary with more values than its page has bytes. What is no head passes.
///
/// # Errors
/// What it promises.
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
                    return Err(format!("a dictionary is said to have {values} values in {unpacked} bytes"));
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
                        "a page is said to have {unpacked} bytes when it is unpacked, at most {most} are expected of a file of this size"
                    ));
                }
            }
            // The length comes before all other kinds of fields.
            _ => return Ok(()),
        }
    }
    Ok(())
}

/// The type of the next field, whose number is made that of this one; none at the end.
fn next(rest: &mut &[u8], field: &mut u64) -> Option<u8> {
    let (byte, after) = rest.split_first()?;
    let step = u64::from(byte >> 4);
    // A field without step says its number, as no head does.
    if *byte == 0 || step == 0 {
        return None;
    }
    (*rest, *field) = (after, *field + step);
    Some(byte & 15)
}

/// A number of variable length, of which every other one is negative; those count as 0.
fn number(rest: &mut &[u8]) -> Option<u64> {
    let length = rest.iter().take(5).position(|byte| byte & 128 == 0)? + 1;
    let (bytes, after) = rest.split_at_checked(length)?;
    *rest = after;
    let value = bytes.iter().rev().fold(0_u64, |value, byte| value << 7 | u64::from(byte & 127));
    Some(if value & 1 == 0 { value >> 1 } else { 0 })
}
