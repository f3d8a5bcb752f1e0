//! A connection that one thread reads while another one writes.

use std::io::{Read, Result, Write};
use std::net::TcpStream;
use std::sync::{Arc, Mutex, PoisonError};

/// A connection with a reader and a writer of its own; what is written at once stays together. Clones share it.
#[derive(Clone)]
pub struct Duplex {
    reader: Arc<TcpStream>,
    writer: Arc<Mutex<TcpStream>>,
}

impl Duplex {
    /// Takes a connection over.
    ///
    /// # Errors
    /// When the system gives no second handle of it.
    pub fn new(stream: TcpStream) -> Result<Self> {
        Ok(Self { reader: Arc::new(stream.try_clone()?), writer: Arc::new(Mutex::new(stream)) })
    }

    /// The connection, for its options.
    pub fn stream(&self) -> &TcpStream {
        &self.reader
    }
}

impl Read for Duplex {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        (&*self.reader).read(buffer)
    }
}

impl Write for Duplex {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.writer.lock().unwrap_or_else(PoisonError::into_inner).write_all(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
