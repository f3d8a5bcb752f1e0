//! What the scripts show of a robot: its links, the bodies of the scene and its fingertips with their forces over time, and what it did as lanes.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::geometry::pose;
use teachtree_base::scene::Role;
use teachtree_command::Commands;
use teachtree_report::page::decimation::{Decimation, DecimationMode, curve, rounded, toggles};
use teachtree_report::page::replay::{one_sign, part};
use teachtree_report::palette::{self, TASKS};
use teachtree_robot::simulation::TaskOutcome;
use teachtree_robot::simulation::trace::{FingerForce, Limb, Trace, TraceSample};
use teachtree_robot::simulation::warnings::Warning;
use teachtree_robot::{CollisionShape, Link, Mesh};

/// Moments in a second.
const RATE_HZ: f64 = 100.0;
/// How far what is drawn may be from where it was, m; the same of a component of a quaternion, and of a force, N.
const WITHIN_M: f64 = 3e-4;
const WITHIN_TURN: f64 = 2e-3;
const WITHIN_N: f64 = 5e-3;
/// Knots of a signal at most.
const KNOTS: usize = 4000;
/// Groups of signals.
const GROUPS: [&str; 2] = ["Forces on the object", "Joints"];

/// A robot's motion at even times.
struct SampledMotion<'t> {
    trace: &'t Trace,
    /// All moments of a time: each hand at work has its own.
    moments: Vec<Vec<&'t TraceSample>>,
    stretches: Vec<Range<usize>>,
}

/// What the scripts show of a robot.
pub(crate) fn data(commands: &Commands, trace: &Trace, outcomes: &[TaskOutcome], warnings: &[Warning]) -> Value {
    let frames = SampledMotion::new(trace);
    let start = frames.moments.first().and_then(|all| all.first()).map_or(0.0, |first| first.time_s);
    let end = frames.moments.last().and_then(|all| all.first()).map_or(0.0, |last| last.time_s);
    let stretches =
        frames.stretches.iter().map(|stretch| json!([stretch.start, stretch.end, frames.time_s(stretch.start)]));
    let issues = warnings.iter().map(|Warning { time_s, kind, link, message }| {
        json!([rounded(*time_s), rounded(*time_s), kind, link, message])
    });
    let mut colors = Map::new();
    let tracks: Vec<Value> = (0..trace.limbs.len()).map(|limb| frames.track(limb, outcomes, &mut colors)).collect();
    json!({
        "log": commands.log,
        "start": rounded(start),
        "end": rounded(end),
        "rate": RATE_HZ,
        "stretches": stretches.collect::<Vec<_>>(),
        "colors": colors,
        "tracks": tracks,
        "texts": [],
        "reasons": [],
        "groups": GROUPS,
        "signals": frames.signals(),
        "issues": issues.collect::<Vec<_>>(),
        "replay": { "bodies": frames.bodies(), "hands": frames.hands(), "objects": [] },
    })
}

impl<'t> SampledMotion<'t> {
    fn new(trace: &'t Trace) -> Self {
        let mut moments: Vec<Vec<&TraceSample>> = Vec::new();
        for moment in &trace.moments {
            match moments.last_mut() {
                Some(all) if all.first().is_some_and(|first| moment.time_s - first.time_s < 0.5 / RATE_HZ) => {
                    all.push(moment)
                }
                _ => moments.push(vec![moment]),
            }
        }
        let time_s = |at: usize| moments.get(at).and_then(|all| all.first()).map_or(0.0, |first| first.time_s);
        let mut stretches: Vec<Range<usize>> = Vec::new();
        for at in 0..moments.len() {
            match stretches.last_mut() {
                Some(last) if time_s(at) - time_s(at - 1) < 1.5 / RATE_HZ => last.end = at + 1,
                _ => stretches.push(at..at + 1),
            }
        }
        Self { trace, moments, stretches }
    }

    fn time_s(&self, at: usize) -> f64 {
        rounded(self.moments.get(at).and_then(|all| all.first()).map_or(0.0, |first| first.time_s))
    }

    /// A moment of each time; all of a time have the same poses.
    fn firsts(&self) -> impl Iterator<Item = &'t TraceSample> {
        self.moments.iter().filter_map(|all| all.first().copied())
    }

    /// What a hand did, its tasks, and what came of them.
    fn track(&self, limb: usize, outcomes: &[TaskOutcome], colors: &mut Map<String, Value>) -> Value {
        let own: Vec<&TraceSample> = self.trace.moments.iter().filter(|moment| moment.limb == limb).collect();
        let span = |run: &[&TraceSample]| {
            let [from, to] = [run.first(), run.last()].map(|moment| moment.map_or(0.0, |moment| moment.time_s));
            (rounded(from), rounded(to + 1.0 / RATE_HZ))
        };
        let mut segments = Vec::new();
        let mut tasks = Vec::new();
        for run in own.chunk_by(|one, next| one.task == next.task) {
            for part in run.chunk_by(|one, next| one.primitive == next.primitive) {
                let Some(first) = part.first() else { continue };
                let (start, end) = span(part);
                let color = palette::color(&first.primitive, Some(first.does)).hex();
                colors.insert(first.primitive.clone(), color.into());
                segments.push(json!([first.primitive, start, end, null, null, "", null]));
            }
            let number = run.first().map_or(0, |first| first.task);
            let Some(outcome) = outcomes.get(number) else { continue };
            let (start, end) = span(run);
            let mut said = vec![outcome.verdict().name().to_string()];
            said.extend(outcome.causes.iter().map(ToString::to_string));
            said.extend(outcome.forces.grip_changes().iter().map(ToString::to_string));
            tasks.push(json!({
                "task": outcome.task, "subject": outcome.object, "start": start, "end": end, "open": [false, false],
                "remarks": said.join("; "), "stability": null,
                "color": TASKS.get(number % TASKS.len()).map(|color| color.hex()), "tried": [],
            }));
        }
        let who = self.trace.limbs.get(limb).map_or("", |limb| limb.side.name());
        json!({
            "who": who, "lanes": ["relabeled", "tasks"], "raw": [], "relabeled": segments, "tasks": tasks,
            "composites": [], "changes": [],
        })
    }

    fn curve(&self, values: &[f64], within: f64, keep: DecimationMode) -> Value {
        curve(values, &self.stretches, Decimation { within, drawn: None, keep }).json
    }

    /// Poses over time as seven curves.
    fn pose(&self, poses: &[Isometry3<f64>]) -> Vec<Value> {
        let all = |of: &dyn Fn(&Isometry3<f64>) -> f64| poses.iter().map(of).collect::<Vec<f64>>();
        let position = [0, 1, 2].map(|axis| all(&|pose| pose.translation.vector[axis]));
        let mut turn: [Vec<f64>; 4] = [
            all(&|pose| pose.rotation.w),
            all(&|pose| pose.rotation.i),
            all(&|pose| pose.rotation.j),
            all(&|pose| pose.rotation.k),
        ];
        one_sign(&mut turn);
        let position = position.iter().map(|values| self.curve(values, WITHIN_M, DecimationMode::Line));
        position.chain(turn.iter().map(|values| self.curve(values, WITHIN_TURN, DecimationMode::Line))).collect()
    }

    /// The bodies of the scene and the links of the robot.
    fn bodies(&self) -> Vec<Value> {
        let mut bodies = Vec::new();
        for (at, (name, body)) in self.trace.scene.bodies.iter().enumerate() {
            let radius = body.bounding_radius();
            if body.parts.is_empty() && radius <= 0.0 {
                continue;
            }
            let role = match body.role {
                Role::Object => "object",
                Role::Support => "support",
                Role::Wall => "wall",
                Role::Socket => "socket",
            };
            let still = pose(body.position.map(|length| length.0), body.rotation);
            let poses: Vec<Isometry3<f64>> =
                self.firsts().map(|moment| moment.bodies.get(at).copied().unwrap_or(still)).collect();
            let parts: Vec<Value> = body.parts.iter().map(part).collect();
            bodies.push(json!({ "name": name, "role": role, "radius": rounded(radius), "parts": parts, "pose": self.pose(&poses) }));
        }
        for (place, limb) in self.trace.limbs.iter().enumerate() {
            bodies.extend(self.links(place, limb));
        }
        bodies
    }

    /// The links of a limb as bodies.
    fn links(&self, place: usize, limb: &Limb) -> Vec<Value> {
        let stances = self.firsts().filter_map(|moment| moment.stances.get(place));
        let all: Vec<Vec<Isometry3<f64>>> = stances
            .map(|stance| {
                let links = limb.robot.tree.forward_kinematics(&stance.q);
                links.into_iter().map(|link| stance.root * link).collect()
            })
            .collect();
        let drawn = |link: &Link| !link.solids.is_empty() || link.look.is_some();
        let links = limb.robot.tree.links.iter().enumerate().filter(|(_, link)| drawn(link));
        links
            .map(|(at, link)| {
                let poses: Vec<Isometry3<f64>> = all.iter().filter_map(|links| links.get(at).copied()).collect();
                let parts: Vec<Value> = match &link.look {
                    Some(look) => vec![mesh(look.points.iter().copied(), &look.triangles)],
                    None => link.solids.iter().flat_map(solid).collect(),
                };
                json!({ "name": link.name, "role": "robot", "radius": 0.01, "parts": parts, "pose": self.pose(&poses) })
            })
            .collect()
    }

    /// The moments in which a limb is at work, by frame.
    fn at_work(&self, limb: usize) -> impl Iterator<Item = Option<&'t TraceSample>> {
        self.moments.iter().map(move |all| all.iter().find(|moment| moment.limb == limb).copied())
    }

    /// The fingertips with their forces.
    fn hands(&self) -> Vec<Value> {
        let mut hands = Vec::new();
        for (place, limb) in self.trace.limbs.iter().enumerate() {
            let Some(model) = limb.robot.hands.get(&limb.side) else { continue };
            let tips: Vec<Vec<Vector3<f64>>> = self
                .firsts()
                .filter_map(|moment| moment.stances.get(place))
                .map(|stance| {
                    let links = limb.robot.tree.forward_kinematics(&stance.q);
                    let tip = |link: usize, at: nalgebra::Point3<f64>| {
                        links.get(link).map(|pose| (stance.root * pose * at).coords)
                    };
                    model.fingers.iter().filter_map(|finger| tip(finger.tip_link, finger.tip_in_link)).collect()
                })
                .collect();
            let fingers = model.fingers.iter().enumerate().map(|(at, finger)| {
                let axis = |axis: usize| -> Vec<f64> {
                    tips.iter().map(|tips| tips.get(at).map_or(f64::NAN, |tip| tip[axis])).collect()
                };
                let position: Vec<Value> = (0..3).map(|one| self.curve(&axis(one), WITHIN_M, DecimationMode::Line)).collect();
                let forces: Vec<Vector3<f64>> =
                    self.at_work(place).map(|moment| moment.map_or_else(Vector3::zeros, |it| self.exerted(it, at))).collect();
                let force = [0, 1, 2].map(|axis| {
                    let values: Vec<f64> = forces.iter().map(|force| force[axis]).collect();
                    self.curve(&values, WITHIN_N, DecimationMode::Line)
                });
                let touches: Vec<bool> = forces.iter().map(|force| *force != Vector3::zeros()).collect();
                json!({ "name": finger.finger.name(), "position": position, "force": force, "touches": toggles(&touches) })
            });
            let radius = model.fingers.first().map_or(0.01, |finger| finger.radius);
            hands.push(json!({
                "side": limb.side.name(), "radius": rounded(radius), "palm": null,
                "fingers": fingers.collect::<Vec<_>>(), "contacts": [], "target": [],
            }));
        }
        hands
    }

    /// The force of a finger on the object of its task, reference frame, N.
    fn exerted(&self, moment: &TraceSample, finger: usize) -> Vector3<f64> {
        let body = moment.bodies.get(moment.object);
        let force = moment.forces.get(finger).map_or_else(Vector3::zeros, |force| force.exerted);
        body.map_or(force, |pose| pose * force)
    }

    /// Returns the demonstrated, commanded and exerted forces, and the joints.
    fn signals(&self) -> Vec<Value> {
        let mut signals = Vec::new();
        let mut signal = |group: usize, limb: &Limb, title: &str, unit: &str, curves: BTreeMap<String, Vec<f64>>| {
            let curves = curves
                .iter()
                .map(|(name, values)| json!([name, self.curve(values, 0.0, DecimationMode::Knots(KNOTS))]));
            let curves: Vec<Value> = curves.collect();
            if !curves.is_empty() {
                signals.push(
                    json!({ "group": group, "title": title, "side": limb.side.name(), "unit": unit, "curves": curves }),
                );
            }
        };
        for (place, limb) in self.trace.limbs.iter().enumerate() {
            let Some(model) = limb.robot.hands.get(&limb.side) else { continue };
            for (at, finger) in model.fingers.iter().enumerate() {
                let of = |which: fn(&FingerForce) -> f64| -> Vec<f64> {
                    let value = |it: &TraceSample| it.forces.get(at).map_or(f64::NAN, which);
                    self.at_work(place).map(|moment| moment.map_or(f64::NAN, value)).collect()
                };
                let demonstrated = of(|force| force.demonstrated.map_or(f64::NAN, |force| force.norm()));
                let mut curves = BTreeMap::from([
                    ("exerted".to_string(), of(|force| force.exerted.norm())),
                    ("commanded".to_string(), of(|force| force.commanded.norm())),
                ]);
                if demonstrated.iter().any(|value| !value.is_nan()) {
                    curves.insert("demonstrated".into(), demonstrated);
                }
                signal(0, limb, &format!("force of the {}", finger.finger), "N", curves);
            }
            let joints = |dofs: &[usize]| -> BTreeMap<String, Vec<f64>> {
                let name = |dof: usize| limb.robot.tree.dofs.get(dof).map_or_else(String::new, |dof| dof.name.clone());
                let value = |dof: usize, moment: &TraceSample| {
                    moment.stances.get(place).and_then(|stance| stance.q.get(dof)).copied().unwrap_or(f64::NAN)
                };
                dofs.iter().map(|&dof| (name(dof), self.firsts().map(|moment| value(dof, moment)).collect())).collect()
            };
            signal(1, limb, "joints of the arm", "rad", joints(&model.arm));
            for finger in &model.fingers {
                signal(1, limb, &format!("joints of the {}", finger.finger), "rad", joints(&finger.dofs));
            }
        }
        signals
    }
}

/// Triangles as a part of a body; its size is that of a box about it.
fn mesh(points: impl Iterator<Item = Point3<f64>>, triangles: &[[usize; 3]]) -> Value {
    let points: Vec<Point3<f64>> = points.collect();
    let [low, high] = Mesh { points: points.clone(), triangles: Vec::new() }.bounds();
    let (middle, size) = ((low + high) / 2.0, high - low);
    // Tenths of a millimeter about the middle.
    let tenths = |point: &Point3<f64>| (point.coords - middle).map(|at| (at * 1e4).round() as i64);
    let points: Vec<i64> = points.iter().flat_map(|point| <[i64; 3]>::from(tenths(point))).collect();
    let [size, at] = [size, middle].map(|all| [all.x, all.y, all.z].map(rounded));
    json!({
        "shape": "mesh", "size": size, "at": at, "turned": [1, 0, 0, 0], "points": points, "faces": triangles.concat(),
    })
}

/// A shape of a link as parts of a body: a bar is a cylinder with a ball at each end.
fn solid(solid: &CollisionShape) -> Vec<Value> {
    let part = |shape: &str, size: &[f64], at: &Isometry3<f64>| {
        let turned = [at.rotation.w, at.rotation.i, at.rotation.j, at.rotation.k].map(rounded);
        let size: Vec<f64> = size.iter().copied().map(rounded).collect();
        let place = [0, 1, 2].map(|axis| rounded(at.translation.vector[axis]));
        json!({ "shape": shape, "size": size, "at": place, "turned": turned })
    };
    match solid {
        CollisionShape::Box(at, half) => vec![part("box", &[2.0 * half.x, 2.0 * half.y, 2.0 * half.z], at)],
        CollisionShape::Piece(at, polytope) => {
            vec![mesh(polytope.points.iter().map(|point| at * point), &polytope.triangles)]
        }
        CollisionShape::Capsule(from, to, radius) => {
            let way = to - from;
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &way).unwrap_or_default();
            let at = |point: Vector3<f64>| Isometry3::from_parts(point.into(), turn);
            vec![
                part("cylinder", &[*radius, way.norm()], &at(nalgebra::center(from, to).coords)),
                part("ball", &[*radius], &at(from.coords)),
                part("ball", &[*radius], &at(to.coords)),
            ]
        }
    }
}
