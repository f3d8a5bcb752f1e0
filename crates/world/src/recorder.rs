//! Records the measurements of the world at 1 kHz, with the ground truth.

use super::operator::{ForceNoise, MeasurementSpec, Perturbation, Rng};
use super::simulation::Observation;
use super::truth::{TruthOptions, WorldState, contact_events, truth};
use indexmap::IndexMap;
use nalgebra::{Isometry3, Vector3};
use std::ops::Range;
use teachtree_base::hands::Finger;
use teachtree_base::log_channel::{BodyPart, ContactPart, FingerPart, LogChannel, columns};
use teachtree_base::recording::{Column, Event, Recording};
use teachtree_base::scene::{Role, Scene};
use teachtree_base::units::Dimension;

/// The first random stream of the force sensors, after those of the hands; each sensor has its own stream.
const SENSOR_STREAM: u64 = 16;
/// The first random stream of the force sensors at the wrists.
const WRIST_STREAM: u64 = 48;

/// The channels of a recording of the virtual environment: fingertips and palms, objects, contacts, and additional measurements.
pub fn recorded<'s>(scene: &'s Scene, seen: &Observation, measured: &MeasurementSpec) -> Vec<LogChannel<'s>> {
    let mut channels = Vec::new();
    for (side, hand) in &scene.hands {
        for finger in &hand.fingers {
            channels.extend(FingerPart::TIP.map(|part| LogChannel::Finger(*side, *finger, part)));
            if measured.contact_flags {
                channels.push(LogChannel::Finger(*side, *finger, FingerPart::Contact));
            }
        }
        channels.extend(LogChannel::palm(*side));
        if measured.wrist_forces {
            channels.push(LogChannel::Finger(*side, Finger::Palm, FingerPart::Force));
        }
        if measured.gripper_openings && hand.fingers.contains(&Finger::Thumb) && hand.fingers.len() > 1 {
            channels.push(LogChannel::GripperOpening(*side));
        }
    }
    let bodies: Vec<_> = scene.bodies.iter().collect();
    for (name, _) in bodies.iter().filter(|(_, body)| body.role == Role::Object) {
        channels.extend(BodyPart::ALL.map(|part| LogChannel::Body(name, part)));
    }
    for contact in &seen.contacts {
        let (name, other) = (bodies[contact.body].0, bodies[contact.other].0);
        channels.extend(ContactPart::VECTORS.map(|part| LogChannel::Contact(name, other, part)));
    }
    channels
}

/// Collects rows.
pub(super) struct Recorder {
    /// Indices of the objects in the scene.
    objects: Vec<usize>,
    time: Vec<f64>,
    /// Values in the order of `names`.
    columns: Vec<Vec<f64>>,
    names: Vec<(String, Dimension)>,
    noise: Vec<Vec<Sensor>>,
    /// The force sensors at the wrists, if they are recorded.
    wrists: Vec<Sensor>,
    /// Radius of the fingertips of each hand, m, if the openings of the hands are recorded.
    grippers: Vec<f64>,
    measured: MeasurementSpec,
    pub(super) moments: Vec<WorldState>,
}

/// The force sensor of a fingertip.
struct Sensor {
    chance: Rng,
    sigma: f64,
    bias: Vector3<f64>,
}

impl Sensor {
    fn new(noise: &ForceNoise, seed: u64, stream: u64) -> Self {
        let mut chance = Rng::new(seed, stream);
        let bias = Vector3::from([(); 3].map(|()| chance.either_way() * noise.bias.0));
        Self { chance, sigma: noise.sigma.0, bias }
    }

    fn measure(&mut self, force: Vector3<f64>) -> Vector3<f64> {
        if self.sigma == 0.0 {
            return force + self.bias;
        }
        force + self.bias + self.chance.noise() * self.sigma
    }
}

impl Recorder {
    /// Returns a recorder of the channels of a scene; the seed determines the `force_noise` of the sensors.
    pub(super) fn new(
        scene: &Scene,
        seen: &Observation,
        measured: &MeasurementSpec,
        force_noise: &ForceNoise,
        seed: u64,
    ) -> Self {
        let bodies: Vec<_> = scene.bodies.iter().collect();
        let names = columns(&recorded(scene, seen, measured));
        let mut stream = SENSOR_STREAM;
        let noise = scene.hands.values().map(|hand| {
            let sensors = hand.fingers.iter().map(|_| {
                stream += 1;
                Sensor::new(force_noise, seed, stream)
            });
            sensors.collect()
        });
        let wrists = (WRIST_STREAM..).zip(scene.hands.values()).filter(|_| measured.wrist_forces);
        let grippers = scene.hands.values().filter(|_| measured.gripper_openings);
        Self {
            wrists: wrists.map(|(stream, _)| Sensor::new(force_noise, seed, stream)).collect(),
            grippers: grippers.map(|hand| hand.tip_radius.0).collect(),
            objects: (0..bodies.len()).filter(|&body| bodies[body].1.role == Role::Object).collect(),
            time: Vec::new(),
            noise: noise.collect(),
            columns: vec![Vec::new(); names.len()],
            names,
            measured: measured.clone(),
            moments: Vec::new(),
        }
    }

    /// The columns: names and dimensions.
    pub(super) fn names(&self) -> &[(String, Dimension)] {
        &self.names
    }

    /// Returns the number of rows.
    pub(super) fn len(&self) -> usize {
        self.time.len()
    }

    /// Returns time and values of a row, in the order of [`names`](Self::names); `None` beyond the last row.
    pub(super) fn row(&self, row: usize) -> Option<(f64, impl Iterator<Item = f64>)> {
        let time = *self.time.get(row)?;
        Some((time, self.columns.iter().map(move |column| column.get(row).copied().unwrap_or(f64::NAN))))
    }

    /// Drops all rows but the first ones.
    pub(super) fn truncate(&mut self, rows: usize) {
        self.time.truncate(rows);
        self.columns.iter_mut().for_each(|column| column.truncate(rows));
        self.moments.truncate(rows);
    }

    /// Time of the latest row, s.
    pub(super) fn time(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    /// Adds a row; values come in the order in which [`Self::new`] named them.
    pub(super) fn record(&mut self, seen: &Observation) {
        self.time.push(self.time.len() as f64 / 1000.0);
        let mut row = Row(Vec::with_capacity(self.columns.len()));
        let moment = WorldState::new(seen);
        for (index, (hand, sensors)) in seen.hands.iter().zip(&mut self.noise).enumerate() {
            for (tip, sensor) in hand.tips.iter().zip(sensors) {
                row.vector(tip.position.coords);
                let force = self.objects.iter().map(|&object| tip.force_on(object)).sum();
                row.vector(sensor.measure(force));
                if self.measured.contact_flags {
                    let touches = self.objects.iter().any(|&object| tip.force_on(object) != Vector3::zeros());
                    row.0.push(f64::from(u8::from(touches)));
                }
            }
            row.pose(&hand.palm);
            if let Some(sensor) = self.wrists.get_mut(index) {
                let touches = hand.tips.iter().flat_map(|tip| &tip.touches);
                row.vector(sensor.measure(touches.map(|touch| touch.force).sum()));
            }
            if let Some(radius) = self.grippers.get(index) {
                row.0.extend(moment.opening(index, *radius).map(|opening| opening.max(0.0)));
            }
        }
        for &object in &self.objects {
            let body = &seen.bodies[object];
            row.pose(&body.pose);
            row.vector(body.velocity);
            row.vector(body.angular_velocity);
        }
        for contact in &seen.contacts {
            row.vector(contact.force);
            row.vector(contact.normal);
        }
        let unit = self.measured.decimals.map(|decimals| 10_f64.powi(i32::from(decimals.min(15))));
        for (column, value) in self.columns.iter_mut().zip(row.0) {
            // Adding zero makes a negative zero positive.
            column.push(unit.map_or(value, |unit| (value * unit).round() / unit + 0.0));
        }
        self.moments.push(moment);
    }

    /// The recording with its ground truth.
    pub(super) fn finish(
        mut self,
        scene: &Scene,
        mut events: Vec<Event>,
        cuts: [Option<f64>; 2],
        options: &TruthOptions,
    ) -> Recording {
        events.extend(contact_events(scene, &self.moments));
        let kept = self.kept(cuts);
        let start_s = self.time.get(kept.start).copied().unwrap_or(0.0);
        let end_s = self.time.get(kept.end - 1).copied().unwrap_or(0.0);
        for event in &mut events {
            event.time_s = if kept.start == 0 { event.time_s } else { event.time_s - start_s };
        }
        events.retain(|event| (0.0..=end_s - start_s).contains(&event.time_s));
        for (side, _) in &scene.hands {
            for (perturbation, cut, time_s) in
                [(Perturbation::LateStart, cuts[0], 0.0), (Perturbation::EarlyEnd, cuts[1], end_s - start_s)]
            {
                let subjects = vec![side.to_string(), perturbation.name().to_string()];
                events.extend(cut.map(|_| Event { time_s, kind: "perturbation_started".into(), subjects }));
            }
        }
        let mut labels = IndexMap::new();
        let truth = truth(scene, &self.moments, &kept, options);
        for (side, of_hand) in scene.hands.keys().zip(truth.hands) {
            labels.insert(format!("{side}.label"), of_hand.labels);
            labels.insert(format!("{side}.task"), of_hand.tasks);
            events.extend(of_hand.begun.into_iter().map(|(row, task)| Event {
                time_s: row as f64 / 1000.0,
                kind: "task_started".into(),
                subjects: vec![side.to_string(), task.to_string()],
            }));
        }
        labels.extend(truth.both.map(|both| ("both.label".to_string(), both)));
        events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        self.time.truncate(kept.len());
        let columns = self.names.into_iter().zip(self.columns);
        let columns = columns
            .map(|((name, dimension), mut values)| {
                values.truncate(kept.end);
                (name, Column { dimension, values: values.split_off(kept.start) })
            })
            .collect();
        Recording { time: self.time, columns, labels, scene: scene.clone(), events, ..Recording::default() }
    }

    /// Returns the kept rows of a recording that begins late or ends early: at least those from the first touch to the last one.
    fn kept(&self, [start, end]: [Option<f64>; 2]) -> Range<usize> {
        let touches = |moment: &WorldState| moment.touches_any(&self.objects);
        let (Some(first), Some(last)) = (self.moments.iter().position(touches), self.moments.iter().rposition(touches))
        else {
            return 0..self.moments.len();
        };
        let share = |share: f64, of: usize| (share * of as f64) as usize;
        let start = start.map_or(0, |depth| share(depth, first));
        let end = end.map_or(self.moments.len(), |depth| last + 1 + share(depth, self.moments.len() - last - 1));
        start..end
    }
}

/// The values of a row.
struct Row(Vec<f64>);

impl Row {
    fn vector(&mut self, vector: Vector3<f64>) {
        self.0.extend(vector.iter());
    }

    fn pose(&mut self, pose: &Isometry3<f64>) {
        self.vector(pose.translation.vector);
        let rotation = pose.rotation;
        self.0.extend([rotation.w, rotation.i, rotation.j, rotation.k]);
    }
}
