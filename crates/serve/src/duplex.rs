//! A connection that one thread reads while another one writes, with TLS or without.

#[cfg(feature = "tls")]
mod tls;

use std::io::{Read, Result, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};

/// A connection with one reader and any number of writers; what is written at once stays together. Clones share it.
#[derive(Clone)]
pub struct Duplex(Arc<Ends>);

struct Ends {
    tcp: TcpStream,
    /// Held while something is written.
    writing: Mutex<()>,
    #[cfg(feature = "tls")]
    tls: Option<tls::Tls>,
}

impl Duplex {
    /// Takes a connection over, without TLS.
    pub fn new(tcp: TcpStream) -> Self {
        Self(Arc::new(Ends {
            tcp,
            writing: Mutex::default(),
            #[cfg(feature = "tls")]
            tls: None,
        }))
    }

    /// Takes the connection of a client over, with TLS. The handshake is part of the first read.
    ///
    /// # Errors
    /// When the configuration is none of a server.
    #[cfg(feature = "tls")]
    pub fn with_tls(tcp: TcpStream, config: Arc<rustls::ServerConfig>) -> Result<Self> {
        Ok(Self(Arc::new(Ends { tcp, writing: Mutex::default(), tls: Some(tls::Tls::new(config)?) })))
    }

    /// The connection below, for its options.
    pub fn tcp(&self) -> &TcpStream {
        &self.0.tcp
    }

    /// Whether both are the same connection.
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Ends the connection in good order; who reads or writes it is no longer held up.
    pub fn close(&self) {
        self.close_writing();
        self.hang_up();
    }

    /// Closes the sending direction. Data from the other side can still be read.
    pub fn close_writing(&self) {
        #[cfg(feature = "tls")]
        if let Some(tls) = &self.0.tls {
            let _turn = self.0.turn();
            tls.close(&self.0.tcp);
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

impl Ends {
    fn turn(&self) -> impl Sized {
        self.writing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Read for Duplex {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        #[cfg(feature = "tls")]
        if let Some(tls) = &self.0.tls {
            return tls.read(&self.0.tcp, buffer, || self.0.turn());
        }
        (&self.0.tcp).read(buffer)
    }
}

impl Write for Duplex {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let _turn = self.0.turn();
        #[cfg(feature = "tls")]
        if let Some(tls) = &self.0.tls {
            return tls.write(&self.0.tcp, bytes);
        }
        (&self.0.tcp).write_all(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
