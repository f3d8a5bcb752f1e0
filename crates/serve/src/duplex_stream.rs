//! A connection that one thread reads while another one writes, with TLS or without.

use std::io::{Read, Result, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A connection with one reader and any number of writers; what is written at once stays together. Clones share it.
#[derive(Clone)]
pub struct DuplexStream(Arc<Inner>);

struct Inner {
    tcp: TcpStream,
    /// Held while something is written.
    writing: Mutex<()>,
    /// `None` without encryption.
    cipher: Option<Box<dyn Cipher>>,
}

/// The encryption of a connection. `read` is called by one thread at a time; `write` and `close` by the thread whose turn it is to write.
pub trait Cipher: Send + Sync {
    /// Decrypts bytes from `tcp` into `buffer`. `turn` waits until this thread may write, which handshakes and changes of keys need.
    ///
    /// # Errors
    /// When the connection breaks or the bytes are not of the protocol.
    fn read<'a>(&self, tcp: &TcpStream, buffer: &mut [u8], turn: &dyn Fn() -> MutexGuard<'a, ()>) -> Result<usize>;

    /// Encrypts and sends all of `bytes`; returns their number.
    ///
    /// # Errors
    /// When the connection breaks.
    fn write(&self, tcp: &TcpStream, bytes: &[u8]) -> Result<usize>;

    /// Sends the end of the encrypted data.
    fn close(&self, tcp: &TcpStream);
}

impl DuplexStream {
    /// Takes a connection over, without TLS.
    pub fn new(tcp: TcpStream) -> Self {
        Self(Arc::new(Inner { tcp, writing: Mutex::default(), cipher: None }))
    }

    /// Takes over a connection whose bytes `cipher` encrypts. The handshake is part of the first read.
    pub fn encrypted(tcp: TcpStream, cipher: Box<dyn Cipher>) -> Self {
        Self(Arc::new(Inner { tcp, writing: Mutex::default(), cipher: Some(cipher) }))
    }

    /// The connection below, for its options.
    pub fn tcp(&self) -> &TcpStream {
        &self.0.tcp
    }

    /// Whether both are the same connection.
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Closes the connection; pending reads and writes return.
    pub fn close(&self) {
        self.close_writing();
        self.hang_up();
    }

    /// Closes the sending direction. Data from the other side can still be read.
    pub fn close_writing(&self) {
        if let Some(cipher) = &self.0.cipher {
            let _turn = self.0.turn();
            cipher.close(&self.0.tcp);
        }
        // The connection may already be closed.
        let _ = self.0.tcp.shutdown(Shutdown::Write);
    }

    /// Ends the connection at once.
    pub fn hang_up(&self) {
        // The connection may already be closed.
        let _ = self.0.tcp.shutdown(Shutdown::Both);
    }
}

impl Inner {
    fn turn(&self) -> MutexGuard<'_, ()> {
        self.writing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Read for DuplexStream {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        if let Some(cipher) = &self.0.cipher {
            return cipher.read(&self.0.tcp, buffer, &|| self.0.turn());
        }
        (&self.0.tcp).read(buffer)
    }
}

impl Write for DuplexStream {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let _turn = self.0.turn();
        if let Some(cipher) = &self.0.cipher {
            return cipher.write(&self.0.tcp, bytes);
        }
        (&self.0.tcp).write_all(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
