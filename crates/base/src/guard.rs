//! Makes a panic of a decoder an error of the file: the decoders of Parquet, HDF5 and meshes may panic on damaged lengths.

use crate::error::InputError;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// Whether this thread is decoding: then a panic is not printed.
    static DECODES: Cell<bool> = const { Cell::new(false) };
}

/// Runs the decoder. What it decoded with must not be used any more after an error.
///
/// # Errors
/// As `decode`, and when it panics: then the file is damaged.
pub fn guarded<T>(name: &str, decode: impl FnOnce() -> Result<T, InputError>) -> Result<T, InputError> {
    static HOOK: Once = Once::new();
    // The hook is one for all threads: panics of others are printed as before.
    HOOK.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic| {
            if !DECODES.get() {
                usual(panic);
            }
        }));
    });
    let outer = DECODES.replace(true);
    let decoded = catch_unwind(AssertUnwindSafe(decode));
    DECODES.set(outer);
    decoded.unwrap_or_else(|_| Err(InputError::new(name, "is damaged: its contents cannot be decoded")))
}
