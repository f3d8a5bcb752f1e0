//! What a log and its scene lack for a channel of the rules, in words.

use std::collections::BTreeSet;
use teachtree_base::channels::{ChannelSpec, DISTANCE_KNOWN, Fallback, GRASP_KNOWN, ROTATION_KNOWN};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::{Body, Role, Scene};
use teachtree_frames::OpenedLog;

/// The columns of a log, and its scene.
pub struct LogContents<'a> {
    /// By their canonical names.
    columns: Vec<&'a str>,
    scene: &'a Scene,
    /// Where a channel that is lacking would come from: `bound` by a binding, else `logged`.
    verb: &'static str,
    /// The flags that the binding sets to a constant, by channel.
    constant_flags: &'a BTreeSet<String>,
}

impl<'a> LogContents<'a> {
    /// The contents of an opened log; `has_binding` if its columns are those of a binding.
    pub fn new(opened: &'a OpenedLog, has_binding: bool) -> Self {
        Self {
            columns: opened.recording.columns.keys().map(String::as_str).collect(),
            scene: &opened.recording.scene,
            verb: if has_binding { "bound" } else { "logged" },
            constant_flags: &opened.constant_flags,
        }
    }

    /// Whether the binding sets a flag of a hand to a constant.
    pub fn is_set_by_binding(&self, channel: &str, side: Side) -> bool {
        self.constant_flags.contains(&format!("{side}.{channel}"))
    }

    /// Why a channel is zero in any recording with these columns and this scene: ``no force of the fingers is bound``. `None` if it can change. A channel that
    /// is measured and constant is not lacking: nothing happened. Only channels that are zero are asked for.
    pub fn lack(&self, channel: &ChannelSpec, side: Option<Side>) -> Option<String> {
        if channel.absent != Fallback::Derived {
            return self.raw_lack(channel, side);
        }
        match channel.name.as_str() {
            "target.depth" | "target.sinking" | "target.over_socket" | "target.in_plain_socket" => self.socket_lack(),
            "closing" => self.socket_of_object_lack(),
            "target.rotation" | "target.angular_velocity" | "target.spin" => {
                self.object_lack("rotation", &["rotation", "angular_velocity", "angle"])
            }
            "target.position" | "target.velocity" => self.object_lack("position", &["position", "velocity"]),
            "target.weight" => {
                let has_mass = self.objects().any(|(_, body)| body.mass.is_some());
                (!has_mass).then(|| "the scene gives no object a mass".into())
            }
            "load" | "push" => {
                (!self.has_quantity("force", side)).then(|| format!("no force of the fingers is {}", self.verb))
            }
            DISTANCE_KNOWN => self.distance_lack(side),
            GRASP_KNOWN => Some(format!("neither a touch of a fingertip nor a gripper is {}", self.verb)),
            // A rotation without the positions shows nothing.
            ROTATION_KNOWN => self
                .distance_lack(side)
                .or_else(|| Some(format!("neither the rotation of the hand nor that of an object is {}", self.verb))),
            _ => None,
        }
    }

    /// What a log without contacts of its objects lacks: shapes, from which contacts are computed where the log has the positions.
    pub fn contacts_lack(&self) -> String {
        let is_alone = |name: &str| self.scene.bodies.iter().all(|(other, it)| other == name || it.parts.is_empty());
        let lacks_shapes = |(name, body): &(&String, &Body)| {
            self.measures(name, &["position"]) && (body.parts.is_empty() || is_alone(name))
        };
        match self.objects().find(lacks_shapes) {
            Some((name, _)) => format!(
                "the log has no contacts (computed if the scene has `parts` of `{name}` and of the bodies that it touches)"
            ),
            None => "the log has no contacts".into(),
        }
    }

    /// The lack of a channel that is read from the log. The contact of a finger is also computed from its force or from the gripper.
    fn raw_lack(&self, channel: &ChannelSpec, side: Option<Side>) -> Option<String> {
        let quantity = channel.name.rsplit('.').next().unwrap_or_default();
        let other = match &channel.absent {
            Fallback::NormAbove { channel, .. } => channel.rsplit('.').next(),
            _ => None,
        };
        let is_shown = [Some(quantity), other, other.map(|_| "gripper")]
            .into_iter()
            .flatten()
            .any(|quantity| self.has_quantity(quantity, side));
        let lack = || match channel.name.strip_prefix("fingers.") {
            Some(_) => format!("no {quantity} of the fingers is {}", self.verb),
            None => format!("no `{}` is {}", channel.name, self.verb),
        };
        (!is_shown).then(lack)
    }

    /// Whether a column has this quantity, of the hand if there is one.
    fn has_quantity(&self, quantity: &str, side: Option<Side>) -> bool {
        let has = |column: &str, name: &str| column.split('.').any(|part| part == name);
        self.columns.iter().any(|column| has(column, quantity) && side.is_none_or(|side| has(column, side.name())))
    }

    fn objects(&self) -> impl Iterator<Item = (&String, &Body)> {
        self.scene.bodies.iter().filter(|(_, body)| body.role == Role::Object)
    }

    /// Whether the log has one of these quantities of a body.
    fn measures(&self, body: &str, quantities: &[&str]) -> bool {
        let has = |column: &str| {
            let rest = column.strip_prefix(body).and_then(|rest| rest.strip_prefix('.'));
            rest.and_then(|rest| rest.split('.').next()).is_some_and(|quantity| quantities.contains(&quantity))
        };
        self.columns.iter().any(|column| has(column))
    }

    fn object_lack(&self, wanted: &str, quantities: &[&str]) -> Option<String> {
        let is_measured = self.objects().any(|(name, _)| self.measures(name, quantities));
        (!is_measured).then(|| format!("no {wanted} of an object is {}", self.verb))
    }

    /// Whether an object fits into a socket of this body.
    fn takes_object(&self, holder: &str, body: &Body) -> bool {
        let takes = |name: &str| name != holder && body.sockets.values().any(|socket| socket.takes(name));
        self.objects().any(|(name, _)| takes(name))
    }

    fn socket_lack(&self) -> Option<String> {
        let mut bodies = self.scene.bodies.iter();
        if bodies.any(|(name, body)| self.takes_object(name, body)) {
            return self.object_lack("position", &["position", "depth", "angle"]);
        }
        Some(self.no_socket("no socket of the scene takes an object"))
    }

    fn socket_of_object_lack(&self) -> Option<String> {
        let has_socket = self.objects().any(|(name, body)| self.takes_object(name, body));
        (!has_socket).then(|| self.no_socket("no object of the scene has a socket for another one"))
    }

    fn no_socket(&self, unless: &str) -> String {
        let has_socket = self.scene.bodies.values().any(|body| !body.sockets.is_empty());
        if has_socket { unless.into() } else { "the scene has no socket".into() }
    }

    /// What the distance of a hand from its target lacks. An object that is fixed to the hand hides it, which is not a lack of the log.
    fn distance_lack(&self, side: Option<Side>) -> Option<String> {
        let side = side?;
        let mut tips = Finger::ALL.iter().filter(|finger| **finger != Finger::Palm);
        if !tips.any(|finger| self.measures(&format!("{side}.{finger}"), &["position"])) {
            return Some(format!("no position of the {side} hand is {}", self.verb));
        }
        if self.objects().any(|(_, body)| body.fixed_to == Some(side)) {
            return None;
        }
        let unseen = self.objects().find(|(name, _)| !self.measures(name, &["position"]));
        unseen.map(|(name, _)| format!("no position of `{name}` is {}", self.verb))
    }
}
