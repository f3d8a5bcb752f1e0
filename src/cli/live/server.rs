//! A server of the Foxglove WebSocket protocol, from which viewers show labels and controllers take events.

use super::foxglove::PROTOCOLS;
use super::hub::{Hub, ReadFrom, Subscriptions};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use teachtree_base::error::InputError;
use teachtree_logs::foxglove::{ClientMessage, advertise, data, server_info, status};
use teachtree_serve::duplex_stream::DuplexStream;
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket, accept_hdr_with_config};

/// Maximum number of connections.
const MOST_CLIENTS: usize = 32;
/// The largest message that a client may send, bytes.
const MAX_MESSAGE: usize = 1 << 20;
/// The timeouts for a client's request and for sending a message.
const PATIENCE: Duration = Duration::from_secs(5);

/// The address that a text says, `8765` or `0.0.0.0:8765`; without a host only this machine is served.
///
/// # Errors
/// It says none.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    let port = text.parse().map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    port.or_else(|_| text.parse())
        .map_err(|_| "expected a port or an address, such as 8765 or 0.0.0.0:8765".to_string())
}

/// Normalizes the origin of a site to the form that browsers send.
///
/// # Errors
/// The text is not an origin.
pub fn origin(text: &str) -> Result<String, String> {
    let text = text.trim_end_matches('/').to_ascii_lowercase();
    let host = ["http://", "https://"].iter().find_map(|scheme| text.strip_prefix(scheme));
    match host {
        Some(host) if !host.is_empty() && !host.contains(['/', '?', '#', '@', ' ', '*']) => Ok(text),
        _ => Err("expected a scheme and a host, such as https://app.foxglove.dev".into()),
    }
}

/// Whether pages of this origin may read the served labels: pages of this machine, of desktop viewers (`file://`) and of the sites in `named`. Programs other
/// than browsers send no origin.
fn may_read(origin: &str, named: &[String]) -> bool {
    let host = ["http://", "https://"].iter().find_map(|scheme| origin.strip_prefix(scheme)).unwrap_or_default();
    let host = match host.rsplit_once(':') {
        Some((host, port)) if port.bytes().all(|digit| digit.is_ascii_digit()) => host,
        _ => host,
    };
    origin == "file://" || ["localhost", "127.0.0.1", "[::1]"].contains(&host) || named.iter().any(|it| it == origin)
}

/// Starts the server, which also accepts pages of `origins`, and returns its address.
///
/// # Errors
/// The port is not available.
pub fn begin(address: SocketAddr, origins: &[String], hub: &Arc<Hub>) -> Result<SocketAddr, InputError> {
    let failed = |error: std::io::Error| InputError::new(address.to_string(), format!("cannot be served on: {error}"));
    let listener = TcpListener::bind(address).map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let (hub, origins) = (Arc::clone(hub), Arc::<[String]>::from(origins));
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (hub, origins) = (Arc::clone(&hub), Arc::clone(&origins));
            if hub.enter(MOST_CLIENTS) {
                thread::spawn(move || {
                    // A client that goes, or says nothing that is understood, is not news.
                    let _ = serve(stream, &origins, &hub);
                    hub.leave();
                });
            }
        }
    });
    Ok(address)
}

/// Serves a client until it goes.
fn serve(stream: TcpStream, origins: &[String], hub: &Arc<Hub>) -> tungstenite::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let both = DuplexStream::new(stream);
    let mut from = None;
    let config = WebSocketConfig::default().max_message_size(Some(MAX_MESSAGE)).max_frame_size(Some(MAX_MESSAGE));
    #[allow(clippy::result_large_err, reason = "the type is the library's")]
    let greet = |request: &Request, response: Response| {
        from = Some(wanted(request.uri().query().unwrap_or_default(), hub));
        greeted(request, response, origins)
    };
    let mut reading = accept_hdr_with_config(both.clone(), greet, Some(config)).map_err(|error| match error {
        tungstenite::HandshakeError::Failure(error) => error,
        tungstenite::HandshakeError::Interrupted(_) => tungstenite::Error::ConnectionClosed,
    })?;
    both.tcp().set_read_timeout(None)?;
    let mut writing = WebSocket::from_raw_socket(both.clone(), Role::Server, None);
    writing.send(Message::text(server_info(&hub.session)))?;
    writing.send(Message::text(advertise(&hub.topics)))?;
    let (subscriptions, is_gone) = (Arc::new(Mutex::new(Subscriptions::default())), Arc::new(AtomicBool::new(false)));
    let reader = {
        let (hub, subscriptions, is_gone) = (Arc::clone(hub), Arc::clone(&subscriptions), Arc::clone(&is_gone));
        let from = from.unwrap_or(ReadFrom::Last);
        thread::spawn(move || {
            while let Ok(message) = reading.read() {
                if let Message::Text(text) = &message {
                    take(ClientMessage::parse(text.as_str()), &hub, &subscriptions, from);
                }
            }
            is_gone.store(true, Ordering::Relaxed);
            hub.wake();
        })
    };
    let written = write(&mut writing, hub, &subscriptions, &is_gone);
    both.close();
    let _ = reader.join();
    written
}

/// Accepts the handshake of an allowed page with the common subprotocol.
#[allow(clippy::result_large_err, reason = "the type is the library's")]
fn greeted(request: &Request, mut response: Response, origins: &[String]) -> Result<Response, ErrorResponse> {
    let refused = |status: StatusCode, message: String| {
        let mut refusal = ErrorResponse::new(Some(message));
        *refusal.status_mut() = status;
        Err(refusal)
    };
    let from: Vec<&HeaderValue> = request.headers().get_all("Origin").iter().collect();
    let may = |origin: &HeaderValue| origin.to_str().is_ok_and(|origin| may_read(origin, origins));
    if from.len() > 1 || !from.into_iter().all(may) {
        let message = "the request comes from a page of another site, which `--serve-origin` does not name\n";
        return refused(StatusCode::FORBIDDEN, message.into());
    }
    let headers = request.headers().get_all("Sec-WebSocket-Protocol");
    let offered: Vec<&str> =
        headers.iter().filter_map(|value| value.to_str().ok()).flat_map(|text| text.split(',')).collect();
    let Some(protocol) = PROTOCOLS.iter().find(|protocol| offered.iter().any(|name| name.trim() == **protocol)) else {
        return refused(StatusCode::BAD_REQUEST, format!("expected the protocol {}\n", PROTOCOLS.join(" or ")));
    };
    response.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static(protocol));
    Ok(response)
}

/// From where on a client reads, as its address says: `?session=…&after=120`.
fn wanted(query: &str, hub: &Hub) -> ReadFrom {
    let value = |key: &str| query.split('&').find_map(|part| part.strip_prefix(key)?.strip_prefix('='));
    value("after").map_or(ReadFrom::Last, |after| hub.resume(value("session"), after))
}

fn take(message: ClientMessage, hub: &Hub, subscriptions: &Mutex<Subscriptions>, from: ReadFrom) {
    match message {
        ClientMessage::Subscribe(wanted) => {
            for (id, channel) in wanted {
                hub.subscribe(subscriptions, id, usize::try_from(channel).unwrap_or(usize::MAX), from);
            }
        }
        ClientMessage::Unsubscribe(ids) => {
            let mut subscriptions = subscriptions.lock().unwrap_or_else(PoisonError::into_inner);
            ids.into_iter().for_each(|id| subscriptions.remove(id));
        }
        ClientMessage::Other => {}
    }
    hub.wake();
}

/// Sends what a client has subscribed to until it goes, or nothing comes any more.
fn write(
    socket: &mut WebSocket<DuplexStream>,
    hub: &Hub,
    subscriptions: &Mutex<Subscriptions>,
    is_gone: &AtomicBool,
) -> tungstenite::Result<()> {
    while let Some(batch) = hub.next(subscriptions, || is_gone.load(Ordering::Relaxed)) {
        if batch.dropped > 0 {
            socket.write(Message::text(status(&format!("{} messages were dropped", batch.dropped))))?;
        }
        for (subscription, message) in &batch.messages {
            socket.write(Message::binary(data(*subscription, message.time_ns, &message.bytes)))?;
        }
        socket.flush()?;
        if batch.is_last {
            socket.close(None)?;
            return socket.flush();
        }
    }
    Ok(())
}
