//! Sockets: how deep an object is in a hole, or on a peg, and whether it is searching for one.

use super::motion::{Motion, slope};
use crate::clean::preprocess::{CleanLog, State};
use nalgebra::Vector3;
use teachtree_base::scene::Scene;

/// Once in, an object is in until its plug point is this many radii from the axis.
const LEAVES_AT: f64 = 1.5;
/// How far beyond the radius of a socket the plug point may be while it searches for the socket, m.
pub const SEARCH_BESIDE: f64 = 0.020;
/// How far above the rim it may be, m.
pub const SEARCH_ABOVE: f64 = 0.030;
/// How far below the rim it may be while it tilts over the edge, m.
pub const SEARCH_BELOW: f64 = 0.005;

/// A socket with the body it is fixed to.
pub struct Socket<'a> {
    /// Index of its body in the scene.
    pub body: usize,
    /// Its name in the body.
    pub name: &'a str,
    socket: &'a teachtree_base::scene::Socket,
}

/// All sockets of a scene, in file order.
pub fn sockets(scene: &Scene) -> Vec<Socket<'_>> {
    let bodies = scene.bodies.values().enumerate();
    bodies.flat_map(|(body, it)| it.sockets.iter().map(move |(name, socket)| Socket { body, name, socket })).collect()
}

impl Socket<'_> {
    /// Whether it has neither thread nor bearing.
    pub const fn is_plain(&self) -> bool {
        self.socket.pitch.is_none()
    }

    /// The direction out of the socket in the reference frame; vertical when the file gives none.
    pub fn axis(&self, motions: &[Motion], frame: usize) -> Vector3<f64> {
        let in_body = self.socket.frame();
        motions.get(self.body).map_or(in_body, |motion| in_body.placed(&motion.pose(frame))).axis
    }

    fn takes(&self, body: usize, name: &str) -> bool {
        self.body != body && self.socket.takes(name)
    }
}

/// What a log says of an object in a socket: `<object>.angle.<socket>` or `<object>.depth.<socket>`.
pub fn logged<'a>(measured: &'a CleanLog, body: &str, quantity: &str, socket: &Socket) -> Option<&'a [f64]> {
    measured.scalar(&format!("{body}.{quantity}.{}", socket.name))
}

/// An object against the sockets it fits, over the whole log.
pub struct Insertion {
    /// The socket it is in, as an index in [`sockets`].
    pub socket: Vec<Option<usize>>,
    /// How deep it is, m; 0 when it is in none.
    pub depth: Vec<f64>,
    /// How fast that grows, without tremor, m/s; 0 when it is in none.
    pub rate: Vec<f64>,
    /// 1 while it searches for a socket, else 0.
    pub over: Vec<f64>,
}

/// Follows an object through the log. A logged channel `<object>.depth.<socket>` is used where there is one, geometry elsewhere; an object whose
/// angle in a socket is logged is in it all along.
pub fn plugged(measured: &CleanLog, motions: &[Motion], sockets: &[Socket], body: usize) -> Insertion {
    let frames = measured.len();
    let zeros = || vec![0.0; frames];
    let mut plugged = Insertion { socket: vec![None; frames], depth: zeros(), rate: zeros(), over: zeros() };
    let Some(((name, it), motion)) = measured.scene.bodies.get_index(body).zip(motions.get(body)) else {
        return plugged;
    };
    let plug = it.plug_point();
    for (index, socket) in sockets.iter().enumerate().filter(|(_, socket)| socket.takes(body, name)) {
        let Some(holder) = motions.get(socket.body) else { continue };
        let in_holder = socket.socket.frame();
        let radius = socket.socket.radius.0;
        // Where the plug point is, as seen from the rim: along the axis and beside it, m.
        let places: Vec<(f64, f64)> = (0..frames)
            .map(|frame| {
                let seen = in_holder.placed(&holder.pose(frame)).see(&(motion.pose(frame) * plug));
                (seen.height, seen.beside.norm())
            })
            .collect();
        let known = logged(measured, name, "depth", socket).map(<[f64]>::to_vec);
        let turns = || logged(measured, name, "angle", socket).map(|angle| vec![socket.socket.depth.0; angle.len()]);
        let known = known.or_else(turns);
        let is_known = known.is_some();
        let depths = known.unwrap_or_else(|| places.iter().map(|(height, _)| -height).collect());
        let mut ever_inside = false;
        measured.follow(&format!("{name} in {index}"), |frame, was| {
            let (Some(&(height, beside)), Some(&depth)) = (places.get(frame), depths.get(frame)) else { return was };
            let allowed = if was.on { LEAVES_AT * radius } else { radius };
            let within = depth <= socket.socket.depth.0 + radius && beside <= allowed;
            let inside = depth > 0.0 && (is_known || within);
            if let (true, Some(in_socket), Some(in_depth)) =
                (inside, plugged.socket.get_mut(frame), plugged.depth.get_mut(frame))
                && depth > *in_depth
            {
                (*in_socket, *in_depth) = (Some(index), depth);
                ever_inside = true;
            }
            let searching = beside <= radius + SEARCH_BESIDE && (-SEARCH_BELOW..=SEARCH_ABOVE).contains(&height);
            if let (true, Some(over)) = (searching, plugged.over.get_mut(frame)) {
                *over = 1.0;
            }
            State { on: inside, ..was }
        });
        if ever_inside {
            let rates = slope(measured, &depths);
            let inside = plugged.rate.iter_mut().zip(&plugged.socket).zip(rates);
            inside.filter(|((_, socket), _)| **socket == Some(index)).for_each(|((rate, _), value)| *rate = value);
        }
    }
    for (over, depth) in plugged.over.iter_mut().zip(&plugged.depth) {
        // Rules take an object for inserted only from some depth on: until then it is still searching.
        if *depth > SEARCH_BELOW {
            *over = 0.0;
        }
    }
    plugged
}
