//! The joints of a robot file: which can be driven, within what, and which follow others.

use super::{SourceMap, no_turn};
use indexmap::IndexMap;
use nalgebra::{Unit, Vector3};
use serde::Deserialize;
use std::f64::consts::TAU;
use teachtree_base::error::InputError;
use teachtree_base::quantity::{Acceleration, Angle, AngularSpeed, Force, Length, Quantity, Speed};
use teachtree_base::short_number::ShortNumber;
use teachtree_description::limits::SPEEDS_UP_S;
use teachtree_description::tree::{Dof, Joint, JointKind, KinematicTree};

type Torque = Quantity<2, 1, -2, 0>;
type Inertia = Quantity<2, 1, 0, 0>;
type AngularAcceleration = Quantity<0, 0, -2, 1>;
type AngularJerk = Quantity<0, 0, -3, 1>;
type Jerk = Quantity<1, 0, -3, 0>;
type TurningDamping = Quantity<2, 1, -1, -1>;

/// A joint between two links.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct JointFile {
    /// The link that it is on.
    pub(super) parent: String,
    /// The link that it moves.
    pub(super) child: String,
    /// Where the child stands, frame of the parent.
    #[serde(default)]
    pub(super) at: [Length; 3],
    /// How the child is turned there, parent_from_child, quaternion w x y z.
    #[serde(default = "no_turn")]
    pub(super) turned: [f64; 4],
    /// The axis, frame of the child; a joint without one is fixed.
    #[serde(default)]
    axis: Option<[f64; 3]>,
    /// The least and the largest angle of a joint that turns.
    #[serde(default)]
    range: Option<[Angle; 2]>,
    /// The least and the largest way of a joint that slides.
    #[serde(default)]
    travel: Option<[Length; 2]>,
    /// The largest torque of a joint that turns.
    #[serde(default)]
    torque: Option<Torque>,
    /// The largest force of a joint that slides.
    #[serde(default)]
    force: Option<Force>,
    /// The highest speed of a joint that turns.
    #[serde(default)]
    speed: Option<AngularSpeed>,
    /// The highest speed of a joint that slides.
    #[serde(default)]
    slide_speed: Option<Speed>,
    /// The highest acceleration of a joint that turns.
    #[serde(default)]
    acceleration: Option<AngularAcceleration>,
    /// The highest acceleration of a joint that slides.
    #[serde(default)]
    slide_acceleration: Option<Acceleration>,
    /// The largest jerk of a joint that turns.
    #[serde(default)]
    jerk: Option<AngularJerk>,
    /// The largest jerk of a joint that slides.
    #[serde(default)]
    slide_jerk: Option<Jerk>,
    /// Inertia of the rotor, at the joint.
    #[serde(default)]
    armature: Inertia,
    /// Viscous friction.
    #[serde(default)]
    damping: TurningDamping,
    /// Dry friction.
    #[serde(default)]
    friction: Torque,
    /// The joint that it follows, in place of limits of its own.
    #[serde(default)]
    coupled: Option<CoupledFile>,
    /// Where the numbers come from.
    source: String,
}

/// A joint that another one follows.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct CoupledFile {
    /// The joint that is followed.
    to: String,
    /// The angle over that of the joint.
    ratio: f64,
}

/// What a URDF does not say of a joint.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct LimitFile {
    /// The highest acceleration of a joint that turns.
    #[serde(default)]
    acceleration: Option<AngularAcceleration>,
    /// The highest acceleration of a joint that slides.
    #[serde(default)]
    slide_acceleration: Option<Acceleration>,
    /// The largest jerk of a joint that turns.
    #[serde(default)]
    jerk: Option<AngularJerk>,
    /// The largest jerk of a joint that slides.
    #[serde(default)]
    slide_jerk: Option<Jerk>,
    /// Where the numbers come from.
    source: String,
}

/// Gives the joints of a URDF the limits that stand beside it.
pub(super) fn limit(
    tree: &mut KinematicTree,
    limits: &IndexMap<String, LimitFile>,
    places: &SourceMap<'_>,
) -> Result<(), InputError> {
    for (name, own) in limits {
        let refuse = |message: String| places.error("limits", name, message);
        if own.source.trim().is_empty() {
            return Err(refuse("has an empty `source`".into()));
        }
        let joint = tree.links.iter().filter_map(|link| link.joint.as_ref()).find(|joint| joint.name == *name);
        let joint = joint.filter(|joint| tree.dofs.get(joint.dof).is_some_and(|dof| dof.name == *name));
        let joint = joint.ok_or_else(|| refuse("is not a driven joint of the URDF".into()))?;
        let turns = joint.kind == JointKind::Revolute;
        let acceleration =
            limit_of(turns, "acceleration", [own.acceleration.map(|it| it.0), own.slide_acceleration.map(|it| it.0)])
                .map_err(refuse)?;
        let jerk = limit_of(turns, "jerk", [own.jerk.map(|it| it.0), own.slide_jerk.map(|it| it.0)]).map_err(refuse)?;
        if acceleration.or(jerk).is_none() {
            return Err(refuse("has no limit, expected an acceleration or a jerk".into()));
        }
        if let Some(dof) = tree.dofs.get_mut(joint.dof) {
            dof.acceleration = acceleration.unwrap_or(dof.acceleration);
            dof.jerk = jerk.unwrap_or(dof.jerk);
        }
    }
    Ok(())
}

/// A limit with one key for joints that turn and one, with `slide_` before it, for joints that slide; `None` where it is not given.
fn limit_of(turns: bool, what: &str, [turning, sliding]: [Option<f64>; 2]) -> Result<Option<f64>, String> {
    let (key, other) = (what.to_string(), format!("slide_{what}"));
    let (does, key, value, other, foreign) =
        if turns { ("turns", key, turning, other, sliding) } else { ("slides", other, sliding, key, turning) };
    match value {
        _ if foreign.is_some() => Err(format!("{does}, expected `{key}`, found `{other}`")),
        Some(value) if !(value > 0.0 && value <= 1e5) => {
            Err(format!("has the {key} {}, expected more than 0 and at most 1e5", ShortNumber(value)))
        }
        value => Ok(value),
    }
}

/// What can be driven: the joints that are not coupled.
pub(super) fn dofs(joints: &IndexMap<String, JointFile>, places: &SourceMap<'_>) -> Result<Vec<Dof>, InputError> {
    let mut dofs = Vec::new();
    for (name, joint) in joints {
        let refuse = |message: String| places.error("joints", name, message);
        if joint.source.trim().is_empty() {
            return Err(refuse("has an empty `source`, expected where its numbers come from, such as `ours`".into()));
        }
        if let Some(coupled) = &joint.coupled {
            let own = [joint.range.is_some(), joint.travel.is_some(), joint.torque.is_some(), joint.force.is_some()];
            if own.contains(&true) {
                return Err(refuse("is coupled, and has limits of its own".into()));
            }
            match joints.iter().find(|(other, _)| **other == coupled.to) {
                None => return Err(refuse(format!("is coupled to `{}`, which is not a joint", coupled.to))),
                Some((_, other)) if other.coupled.is_some() => {
                    return Err(refuse(format!("is coupled to `{}`, which is coupled itself", coupled.to)));
                }
                Some(_) => {}
            }
            if !(coupled.ratio.is_finite() && coupled.ratio != 0.0 && coupled.ratio.abs() <= 100.0) {
                return Err(refuse(format!("is coupled with the ratio {}, expected up to 100, not 0", coupled.ratio)));
            }
            continue;
        }
        let (range, largest, torque, speed) = match (joint.range, joint.travel) {
            (Some(range), None) => {
                (range.map(|angle| angle.0), TAU, joint.torque.map(|it| it.0), joint.speed.map(|it| it.0))
            }
            (None, Some(travel)) => {
                (travel.map(|length| length.0), 10.0, joint.force.map(|it| it.0), joint.slide_speed.map(|it| it.0))
            }
            _ => {
                return Err(refuse(
                    "needs exactly one of `range` (it turns), `travel` (it slides) and `coupled`".into(),
                ));
            }
        };
        if !(range[0] < range[1] && range.iter().all(|end| end.abs() <= largest)) {
            let unit = if joint.range.is_some() { "rad" } else { "m" };
            return Err(refuse(format!(
                "goes from {} to {} {unit}, expected the smaller end first, within {largest:.4} {unit}",
                ShortNumber(range[0]),
                ShortNumber(range[1])
            )));
        }
        let positive = |what: &str, value: Option<f64>| match value {
            Some(value) if value > 0.0 && value <= 1e5 => Ok(value),
            Some(value) => {
                Err(refuse(format!("has the {what} {}, expected more than 0 and at most 1e5", ShortNumber(value))))
            }
            None => Err(refuse(format!("has no `{what}`"))),
        };
        let (torque_word, speed_word) =
            if joint.range.is_some() { ("torque", "speed") } else { ("force", "slide_speed") };
        let (torque, speed) = (positive(torque_word, torque)?, positive(speed_word, speed)?);
        let turns = joint.range.is_some();
        let acceleration = [joint.acceleration.map(|it| it.0), joint.slide_acceleration.map(|it| it.0)];
        let acceleration =
            limit_of(turns, "acceleration", acceleration).map_err(refuse)?.unwrap_or(speed / SPEEDS_UP_S);
        let jerk = [joint.jerk.map(|it| it.0), joint.slide_jerk.map(|it| it.0)];
        let jerk = limit_of(turns, "jerk", jerk).map_err(refuse)?.unwrap_or(f64::INFINITY);
        for (what, value) in
            [("armature", joint.armature.0), ("damping", joint.damping.0), ("friction", joint.friction.0)]
        {
            if !(0.0..=1e4).contains(&value) {
                return Err(refuse(format!("has the {what} {}, expected 0 to 1e4", ShortNumber(value))));
            }
        }
        let (armature, damping, friction) = (joint.armature.0, joint.damping.0, joint.friction.0);
        dofs.push(Dof { name: name.clone(), range, torque, speed, acceleration, jerk, armature, damping, friction });
    }
    Ok(dofs)
}

/// A joint of the tree, of its own or coupled.
pub(super) fn made_joint(
    name: &str,
    joint: &JointFile,
    joints: &IndexMap<String, JointFile>,
    dofs: &[Dof],
    places: &SourceMap<'_>,
) -> Result<Joint, InputError> {
    let refuse = |message: String| places.error("joints", name, message);
    let (driver, ratio) = joint.coupled.as_ref().map_or((name, 1.0), |coupled| (coupled.to.as_str(), coupled.ratio));
    let dof = dofs.iter().position(|dof| dof.name == driver).ok_or_else(|| refuse("is driven by nothing".into()))?;
    let slides = joints.iter().any(|(other, file)| other == driver && file.travel.is_some());
    let axis = joint.axis.ok_or_else(|| refuse("has no `axis`".into()))?;
    let axis = Unit::try_new(Vector3::from(axis), 1e-6)
        .filter(|axis| axis.iter().all(|part| part.is_finite()))
        .ok_or_else(|| refuse(format!("has the axis {axis:?}, expected a direction")))?;
    Ok(Joint {
        name: name.into(),
        kind: if slides { JointKind::Prismatic } else { JointKind::Revolute },
        axis,
        dof,
        ratio,
    })
}
