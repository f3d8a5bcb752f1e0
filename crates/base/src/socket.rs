//! The geometry of sockets: where a plug point is, seen from the rim. Recognition, simulation and commands share it.

use crate::scene::{Body, Socket};
use nalgebra::{Isometry3, Point3, Vector3};

/// Rim and axis of a socket, both in the same frame: that of the socket's body, or the reference frame once [placed](Self::placed).
#[derive(Clone, Copy, Debug)]
pub struct SocketFrame {
    /// Position of the plug point just before it enters, m.
    pub rim: Point3<f64>,
    /// Unit direction out of the socket.
    pub axis: Vector3<f64>,
}

/// Where a plug point is, seen from a socket; the frame is that of the [`SocketFrame`].
#[derive(Clone, Copy, Debug)]
pub struct PlugInSocket {
    /// Height above the rim, m; negative inside.
    pub height: f64,
    /// From the axis to the plug point, at right angles to the axis, m.
    pub beside: Vector3<f64>,
}

impl Socket {
    /// Rim and axis in the frame of the socket's body; the axis is vertical when the file gives none.
    pub fn frame(&self) -> SocketFrame {
        SocketFrame {
            rim: Point3::from(self.rim.map(|length| length.0)),
            axis: Vector3::from(self.axis).try_normalize(1e-9).unwrap_or_else(Vector3::z),
        }
    }

    /// Whether an object with this name fits.
    pub fn takes(&self, object: &str) -> bool {
        self.accepts.as_ref().is_none_or(|accepted| accepted.iter().any(|name| name == object))
    }
}

impl Body {
    /// The point of this body that enters a socket, body frame, m.
    pub fn plug_point(&self) -> Point3<f64> {
        self.plug.map_or_else(Point3::origin, |plug| plug.map(|length| length.0).into())
    }
}

impl SocketFrame {
    /// The same socket in the reference frame, for a pose of its body.
    pub fn placed(&self, world_from_body: &Isometry3<f64>) -> Self {
        Self { rim: world_from_body * self.rim, axis: world_from_body.rotation * self.axis }
    }

    /// Where a plug point in the same frame is.
    pub fn see(&self, plug: &Point3<f64>) -> PlugInSocket {
        let from_rim = plug - self.rim;
        let height = from_rim.dot(&self.axis);
        PlugInSocket { height, beside: from_rim - self.axis * height }
    }
}
