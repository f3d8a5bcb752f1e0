//! The sockets of a scene as places in space: how far an object's plug point is from the rim of a socket, along its axis and beside it.

use super::simulation::BodyState;
use nalgebra::{Point3, Vector3};
use teachtree_base::scene::{Role, Scene, Socket};
use teachtree_base::socket::PlugInSocket;

/// A socket with the objects that fit in.
#[derive(Clone, Debug)]
pub(super) struct SocketSite {
    /// Its name in the scene.
    pub(super) name: String,
    /// Index of the body that it is fixed to.
    pub(super) body: usize,
    pub(super) socket: Socket,
    /// Indices of the objects that fit, each with its plug point in its own frame.
    pub(super) plugs: Vec<(usize, Point3<f64>)>,
}

/// Where a plug point is, seen from a socket; reference frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlugOffset {
    /// Unit direction out of the socket.
    pub(super) axis: Vector3<f64>,
    /// Height above the rim, m; negative inside.
    pub(super) height: f64,
    /// From the axis to the plug point, across the axis, m.
    pub(super) beside: Vector3<f64>,
    /// The plug point.
    pub(super) point: Point3<f64>,
}

/// The sockets of a scene, in file order.
pub(super) fn places(scene: &Scene) -> Vec<SocketSite> {
    let mut places = Vec::new();
    for (body, (_, holder)) in scene.bodies.iter().enumerate() {
        for (name, socket) in &holder.sockets {
            let plugs = scene
                .bodies
                .iter()
                .enumerate()
                .filter(|(index, (name, it))| *index != body && it.role == Role::Object && socket.takes(name));
            let plugs = plugs.map(|(index, (_, it))| (index, it.plug_point()));
            places.push(SocketSite { name: name.clone(), body, socket: socket.clone(), plugs: plugs.collect() });
        }
    }
    places
}

impl SocketSite {
    /// Where the plug point of an object is; `None` for an object that does not fit.
    pub(super) fn plug(&self, object: usize, bodies: &[BodyState]) -> Option<PlugOffset> {
        let (_, plug) = self.plugs.iter().find(|(fits, _)| *fits == object)?;
        let (holder, state) = (bodies.get(self.body)?, bodies.get(object)?);
        let placed = self.socket.frame().placed(&holder.pose);
        let point = state.pose * plug;
        let PlugInSocket { height, beside } = placed.see(&point);
        Some(PlugOffset { axis: placed.axis, height, beside, point })
    }

    /// Whether a plug point that is seen like this is in the socket.
    pub(super) fn holds(&self, plug: &PlugOffset) -> bool {
        let socket = &self.socket;
        plug.height < 0.0
            && -plug.height <= socket.depth.0 + socket.radius.0
            && plug.beside.norm() <= 1.5 * socket.radius.0
    }
}
