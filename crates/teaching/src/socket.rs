//! A WebSocket of a page or a device: one thread reads inputs, another one sends the newest state. A slow client misses states; the servo never waits.

use super::input::handle_message;
use super::protocol::{Message, error, pose_json, vector};
use super::shared_state::{HandSnapshot, StateSnapshot, Teaching, lock};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use teachtree_serve::duplex_stream::DuplexStream;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message as Frame, WebSocket};

/// Maximum size of a message, bytes.
const MAX_MESSAGE: usize = 4096;
/// The timeout for sending a message.
const PATIENCE: Duration = Duration::from_secs(5);
/// Period of states, and shortest period of labels and recordings, in steps.
const STATE_STEPS: u64 = 16;
const LABEL_STEPS: u64 = 80;

/// The answer to a key.
pub(super) fn accept(key: &str) -> String {
    tungstenite::handshake::derive_accept_key(key.as_bytes())
}

/// The shared state of the two threads of a connection.
#[derive(Default)]
struct Connection {
    is_gone: AtomicBool,
    /// Period of forces, in steps; 0 for never.
    forces_every: AtomicU64,
    /// The reason of the last refused message.
    complaint: Mutex<Option<String>>,
}

/// Serves a connection until the client disconnects.
pub(super) fn serve(both: DuplexStream, read: Vec<u8>, teaching: &Arc<Teaching>) {
    let config = WebSocketConfig::default().max_message_size(Some(MAX_MESSAGE)).max_frame_size(Some(MAX_MESSAGE));
    let set = both.tcp().set_read_timeout(None).and_then(|()| both.tcp().set_write_timeout(Some(PATIENCE)));
    if set.is_err() {
        return;
    }
    let mut reading = WebSocket::from_partially_read(both.clone(), read, Role::Server, Some(config));
    let mut writing = WebSocket::from_raw_socket(both.clone(), Role::Server, None);
    let connection = Arc::new(Connection::default());
    let reader = {
        let (connection, teaching) = (Arc::clone(&connection), Arc::clone(teaching));
        std::thread::spawn(move || {
            while let Ok(frame) = reading.read() {
                let taken = match &frame {
                    Frame::Text(text) => take(text.as_str(), &connection, &teaching),
                    Frame::Binary(_) => Err("expected a text in JSON, found bytes".into()),
                    _ => Ok(()),
                };
                if let Err(why) = taken {
                    *connection.complaint.lock().unwrap_or_else(PoisonError::into_inner) = Some(why);
                }
            }
            connection.is_gone.store(true, Ordering::SeqCst);
        })
    };
    // The other side may be gone at any time.
    let _ = write(&mut writing, &connection, teaching);
    both.close();
    let _ = reader.join();
}

fn take(text: &str, connection: &Connection, teaching: &Arc<Teaching>) -> Result<(), String> {
    let message = Message::read(text)?;
    if let Message::Forces { every_ms } = message {
        connection.forces_every.store(every_ms, Ordering::SeqCst);
    }
    handle_message(teaching, message)
}

fn write(
    socket: &mut WebSocket<DuplexStream>,
    connection: &Connection,
    teaching: &Teaching,
) -> tungstenite::Result<()> {
    let mut state_at = 0;
    let mut labels_at = 0;
    let mut forces_sent: u64 = 0;
    let mut versions = (None, None);
    while !connection.is_gone.load(Ordering::SeqCst) && !teaching.stops.load(Ordering::SeqCst) {
        let every = connection.forces_every.load(Ordering::SeqCst);
        // A new period counts from now on.
        let forces_at = forces_sent.saturating_add(every);
        let next = if every == 0 { state_at } else { forces_at.min(state_at) };
        let Some(newest) = teaching.state_after(next.max(1)) else { continue };
        if every > 0 && newest.step >= forces_at {
            forces_sent = newest.step;
            socket.write(Frame::text(forces(&newest).to_string()))?;
        }
        if newest.step >= state_at {
            state_at = newest.step + STATE_STEPS;
            socket.write(Frame::text(state(&newest).to_string()))?;
            let complaint = connection.complaint.lock().unwrap_or_else(PoisonError::into_inner).take();
            if let Some(why) = complaint {
                socket.write(Frame::text(error(&why)))?;
            }
        }
        if newest.step >= labels_at {
            labels_at = newest.step + LABEL_STEPS;
            let labels = {
                let tracks = lock(&teaching.tracks);
                let is_new = versions.0.replace(tracks.version) != Some(tracks.version);
                is_new.then(|| tracks.json(&teaching.styles))
            };
            let takes = {
                let takes = lock(&teaching.takes);
                let is_new = versions.1.replace(takes.version) != Some(takes.version);
                is_new.then(|| takes.json())
            };
            for message in [labels, takes].into_iter().flatten() {
                socket.write(Frame::text(message.to_string()))?;
            }
        }
        socket.flush()?;
    }
    socket.close(None)?;
    socket.flush()
}

/// Time of a step, s.
fn time_s(newest: &StateSnapshot) -> f64 {
    newest.step as f64 / 1000.0
}

fn state(newest: &StateSnapshot) -> Value {
    let hands = newest.hands.iter().map(|hand| {
        json!({
            "palm": pose_json(&hand.palm),
            "tips": hand.tips.iter().map(|tip| vector(&tip.coords)).collect::<Vec<_>>(),
            "forces": hand.forces.iter().map(vector).collect::<Vec<_>>(),
            "silent": hand.is_silent,
        })
    });
    let servo = &newest.servo;
    json!({
        "type": "state", "time": time_s(newest), "epoch": newest.epoch, "recording": newest.is_recording,
        "recorded": newest.rows as f64 / 1000.0,
        "hands": hands.collect::<Vec<_>>(),
        "bodies": newest.bodies.iter().map(pose_json).collect::<Vec<_>>(),
        "servo": { "steps": servo.steps, "within_1_ms": servo.share, "p999_us": servo.p999_us, "latest_us": servo.latest_us, "given_up_ms": servo.given_up_ms },
    })
}

fn forces(newest: &StateSnapshot) -> Value {
    let none = Vector3::zeros();
    let force = |hand: &HandSnapshot, force: &Vector3<f64>| vector(if hand.is_silent { &none } else { force });
    let hands = newest.hands.iter().map(|hand| hand.forces.iter().map(|it| force(hand, it)).collect::<Vec<_>>());
    json!({ "type": "forces", "time": time_s(newest), "epoch": newest.epoch, "hands": hands.collect::<Vec<_>>() })
}
