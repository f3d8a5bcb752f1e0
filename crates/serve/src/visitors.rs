//! The connections that are open. Who has not shown the token cannot keep others out: the oldest of them makes room.

use crate::duplex::Duplex;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The most connections at a time that have shown the token, and that have not.
const MAX_KNOWN: usize = 64;
const MAX_STRANGERS: usize = 32;

/// Connections that are open.
#[derive(Default)]
pub struct Visitors {
    /// Those that have not shown the token, the oldest first.
    strangers: Mutex<VecDeque<Duplex>>,
    /// How many have.
    known: AtomicUsize,
}

impl Visitors {
    fn strangers(&self) -> MutexGuard<'_, VecDeque<Duplex>> {
        self.strangers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A connection begins.
    pub fn enter(&self, stream: &Duplex) {
        let mut strangers = self.strangers();
        strangers.push_back(stream.clone());
        if strangers.len() > MAX_STRANGERS
            && let Some(oldest) = strangers.pop_front()
        {
            oldest.hang_up();
        }
    }

    /// A connection has shown the token; whether there is room for it.
    pub fn admit(&self, stream: &Duplex) -> bool {
        self.forget(stream);
        self.known.fetch_add(1, Ordering::SeqCst) < MAX_KNOWN
    }

    /// A connection ends.
    pub fn leave(&self, stream: &Duplex, is_known: bool) {
        if is_known {
            self.known.fetch_sub(1, Ordering::SeqCst);
        } else {
            self.forget(stream);
        }
    }

    fn forget(&self, stream: &Duplex) {
        self.strangers().retain(|other| !other.is(stream));
    }
}
