//! The open connections. A connection without the token cannot keep others out: the oldest one of them is closed.

use crate::duplex_stream::DuplexStream;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The most connections at a time that have shown the token, and that have not.
const MAX_AUTHENTICATED: usize = 64;
const MAX_UNAUTHENTICATED: usize = 32;

/// The open connections.
#[derive(Default)]
pub struct OpenConnections {
    /// Connections that have not shown the token, the oldest first.
    unauthenticated: Mutex<VecDeque<DuplexStream>>,
    /// Number of connections that have shown the token.
    authenticated: AtomicUsize,
}

impl OpenConnections {
    fn unauthenticated(&self) -> MutexGuard<'_, VecDeque<DuplexStream>> {
        self.unauthenticated.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A connection begins.
    pub fn enter(&self, stream: &DuplexStream) {
        let mut unauthenticated = self.unauthenticated();
        unauthenticated.push_back(stream.clone());
        if unauthenticated.len() > MAX_UNAUTHENTICATED
            && let Some(oldest) = unauthenticated.pop_front()
        {
            oldest.hang_up();
        }
    }

    /// A connection has shown the token; whether there is room for it.
    pub fn admit(&self, stream: &DuplexStream) -> bool {
        self.forget(stream);
        self.authenticated.fetch_add(1, Ordering::SeqCst) < MAX_AUTHENTICATED
    }

    /// A connection ends.
    pub fn leave(&self, stream: &DuplexStream, is_authenticated: bool) {
        if is_authenticated {
            self.authenticated.fetch_sub(1, Ordering::SeqCst);
        } else {
            self.forget(stream);
        }
    }

    fn forget(&self, stream: &DuplexStream) {
        self.unauthenticated().retain(|other| !other.is(stream));
    }
}
