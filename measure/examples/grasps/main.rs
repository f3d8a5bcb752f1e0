//! The list of grasps that grasp mapping is measured on, and the measurement.
//!
//! `cargo example grasps -- generate` draws grasps that are known to be feasible and writes `tests/fixtures/grasps.json`
//! with a reference for each; `… -- refer` keeps the grasps and looks for better references, which are never lowered;
//! `… -- refer quality` or `manipulability` looks for those of one criterion. `cargo example grasps` maps them by each criterion that has references and prints the
//! results.
//!
//! The generator: a shape (box, cylinder or ball, randomly rotated) of 20 to 110 mm; two to five fingers, the thumb among them; a point
//! on the surface for the thumb, and points for the fingers on the other side, 20 to 30 mm apart in a row; then up to 20 000 palm poses about
//! them, until all fingers reach with measures of at least 0.03, pads face the surface and everything is clear: then a solution is known.
//! The reference is the best of that solution, of the same after a local search, and of long global searches (differential evolution, 48 members, 200
//! generations): ten by manipulability, three by quality.

#![allow(clippy::expect_used, reason = "a measurement that cannot be made ends here")]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is what it is for")]

mod list;

use list::{FILE, body, listed, numbers, read};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::time::{SystemTime, UNIX_EPOCH};
use teachtree_base::hands::{Finger, Side};
use teachtree_command::GraspCriterion;
use teachtree_robot::grasp::{Contact, GraspPlanner, GraspRequest, SearchEffort};
use teachtree_robot::{self as robot, HandModel};

const WANTED: usize = 300;
const LEAST: f64 = 0.03;
const TRIES: usize = 20_000;
const GENERATIONS: usize = 200;
/// Processor time, s, for which the mapping of a grasp is repeated.
const LONG_S: f64 = 0.02;
const FINGERS: [Finger; 4] = [Finger::Index, Finger::Middle, Finger::Ring, Finger::Little];

/// The generator splitmix64, with outputs from 0 to 1.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn turn(&mut self) -> UnitQuaternion<f64> {
        let axis = Vector3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
        UnitQuaternion::from_scaled_axis(axis.normalize() * self.between(0.0, std::f64::consts::PI))
    }
}

fn main() {
    let robot = robot::open("gifu_hand_iii_right", &|_| unreachable!("it is shipped")).expect("it is shipped");
    let hand = &robot.hands[&Side::Right];
    match std::env::args().nth(1).as_deref() {
        Some("generate") => generate(hand),
        Some("refer") => {
            let of = std::env::args().nth(2);
            let chosen = |(name, ..): &&Criterion| of.as_deref().is_none_or(|of| of == *name);
            let list = CRITERIA.iter().filter(chosen).fold(listed(), |list, criterion| refer(hand, list, criterion));
            write(&list);
        }
        _ => {
            let list = listed();
            let has_references = |(_, _, key, _): &&Criterion| list.iter().all(|grasp| grasp[*key].is_number());
            CRITERIA.iter().filter(has_references).for_each(|criterion| measure(hand, criterion));
        }
    }
}

/// A criterion of grasps: its name, its value, the key of its references, and the number of searches for each.
type Criterion = (&'static str, GraspCriterion, &'static str, usize);

const CRITERIA: [Criterion; 2] = [
    ("quality", GraspCriterion::Quality, "quality_reference", 3),
    ("manipulability", GraspCriterion::Manipulability, "reference", 10),
];

/// Draws a shape (as YAML) and contacts.
fn draw(chance: &mut SplitMix64) -> Option<(String, Vec<Contact>)> {
    let mm = |m: f64| (m * 1e4).round() / 10.0;
    let kind = (chance.next() * 3.0) as usize;
    let size = [(); 3].map(|()| mm(chance.between(0.02, 0.11)));
    let shape = match kind {
        0 => format!("box: [{} mm, {} mm, {} mm]", size[0], size[1], size[2]),
        1 => format!("cylinder: [{} mm, {} mm]", size[0] / 2.0, size[1]),
        _ => format!("ball: {} mm", size[0] / 2.0),
    };
    let half = size.map(|size| size / 2000.0);
    let fingers = 1 + (chance.next() * 4.0) as usize;
    // The row of fingers: direction of opposition and, across it, of the row.
    let apart = chance.between(0.020, 0.030);
    let middle = [chance.between(-0.5, 0.5), chance.between(-0.5, 0.5)];
    let thumb_off = [chance.between(-0.3, 0.3), chance.between(-0.3, 0.3)];
    let tilt = chance.between(-0.4, 0.4);
    let mut contacts = Vec::new();
    let mut add = |finger: Finger, point: Point3<f64>, normal: Vector3<f64>| {
        contacts.push(Contact { finger, point, normal });
    };
    let row = |index: usize| (index as f64 - (fingers - 1) as f64 / 2.0) * apart;
    match kind {
        0 => {
            let (a, b, c) = [(0, 1, 2), (1, 2, 0), (2, 0, 1)][(chance.next() * 3.0) as usize];
            let at = |side: f64, u: f64, v: f64| {
                let mut p = Vector3::zeros();
                (p[a], p[b], p[c]) = (side * half[a], u, v);
                (u.abs() <= half[b] - 0.002 && v.abs() <= half[c] - 0.002)
                    .then(|| (Point3::from(p), Vector3::ith(a, side)))
            };
            let (p, n) = at(-1.0, thumb_off[0] * half[b], thumb_off[1] * half[c])?;
            add(Finger::Thumb, p, n);
            for (index, finger) in FINGERS.into_iter().enumerate().take(fingers) {
                let along = row(index) + middle[0] * half[b];
                let (p, n) = at(1.0, along * f64::cos(tilt), middle[1] * half[c] + along * f64::sin(tilt))?;
                add(finger, p, n);
            }
        }
        1 => {
            let (radius, height) = (half[0], half[1]);
            let at = |angle: f64, z: f64| {
                let n = Vector3::new(angle.cos(), angle.sin(), 0.0);
                (z.abs() <= height - 0.002).then(|| (Point3::from(n * radius + Vector3::z() * z), n))
            };
            let (p, n) = at(std::f64::consts::PI + 0.3 * thumb_off[0], thumb_off[1] * height)?;
            add(Finger::Thumb, p, n);
            // Along the axis, or about it.
            let about = chance.next() < 0.5;
            for (index, finger) in FINGERS.into_iter().enumerate().take(fingers) {
                let (angle, z) = if about { (row(index) / radius, 0.0) } else { (0.0, row(index)) };
                if angle.abs() > 1.2 {
                    return None;
                }
                let (p, n) = at(angle + 0.4 * middle[0], z + middle[1] * height)?;
                add(finger, p, n);
            }
        }
        _ => {
            let radius = half[0];
            let at = |angle: f64, up: f64| {
                let n = Vector3::new(angle.cos() * up.cos(), angle.sin() * up.cos(), up.sin());
                (Point3::from(n * radius), n)
            };
            let (p, n) = at(std::f64::consts::PI + thumb_off[0], thumb_off[1]);
            add(Finger::Thumb, p, n);
            for (index, finger) in FINGERS.into_iter().enumerate().take(fingers) {
                let angle = row(index) / radius;
                if angle.abs() > 1.2 {
                    return None;
                }
                let (p, n) = at(angle, 0.4 * middle[1]);
                add(finger, p, n);
            }
        }
    }
    let thumb = contacts[0].normal;
    let facing: Vector3<f64> = contacts[1..].iter().map(|contact| contact.normal).sum();
    (thumb.dot(&facing.normalize()) < -0.7).then_some((shape, contacts))
}

fn generate(hand: &HandModel) {
    let planner = GraspPlanner::with_criterion(hand, GraspCriterion::Manipulability);
    let mut found: Vec<Value> = Vec::new();
    let mut seeds = 0..u64::MAX;
    while found.len() < WANTED {
        let some: Vec<u64> = seeds.by_ref().take(200).collect();
        found.par_extend(some.into_par_iter().filter_map(|seed| feasible(&planner, seed)));
    }
    found.truncate(WANTED);
    write(&CRITERIA.iter().fold(found, |found, criterion| refer(hand, found, criterion)));
}

/// Adds to each grasp its reference by a criterion.
fn refer(hand: &HandModel, mut found: Vec<Value>, (name, criterion, key, searches): &Criterion) -> Vec<Value> {
    let planner = GraspPlanner::with_criterion(hand, *criterion);
    eprintln!("{} grasps; now their references by {name}", found.len());
    found.par_iter_mut().for_each(|grasp| {
        let (object, contacts) = read(grasp);
        let wanted = GraspRequest { contacts, object: &object, obstacles: Vec::new() };
        let mut chance = SplitMix64(grasp["seed"].as_u64().unwrap_or(0) ^ 0x5eed);
        let polished = planner.polish(&wanted, &known(grasp)).map_or(0.0, |grasp| grasp.measure);
        let start = planner.at(&wanted, &known(grasp)).map_or(0.0, |grasp| grasp.measure);
        let searches = (0..*searches).filter_map(|_| {
            planner.search_everywhere(&wanted, GENERATIONS, &mut || chance.next()).ok().map(|grasp| grasp.measure)
        });
        // A reference is never lowered.
        let before = grasp[*key].as_f64().unwrap_or(0.0);
        let reference = searches.fold(polished.max(start).max(before), f64::max);
        grasp[*key] = json!((reference * 1e6).round() / 1e6);
    });
    found
}

/// Writes the list.
fn write(found: &[Value]) {
    let lines: Vec<String> = found.iter().map(Value::to_string).collect();
    std::fs::write(FILE, format!("[\n{}\n]\n", lines.join(",\n"))).expect("the list can be written");
}

/// Returns a grasp with a known solution, if this seed gives one.
fn feasible(planner: &GraspPlanner<'_>, seed: u64) -> Option<Value> {
    let mut chance = SplitMix64(seed);
    let (shape, contacts) = draw(&mut chance)?;
    let object = body(&shape);
    let wanted = GraspRequest { contacts, object: &object, obstacles: Vec::new() };
    let points = wanted.contacts.iter().map(|contact| contact.point.coords);
    let middle = points.sum::<Vector3<f64>>() / wanted.contacts.len() as f64;
    let known = (0..TRIES).find_map(|_| {
        let away =
            Translation3::new(-chance.between(0.06, 0.20), chance.between(-0.05, 0.05), -chance.between(-0.02, 0.12));
        let pose = Isometry3::from_parts(Translation3::from(middle), chance.turn()) * away;
        planner.at(&wanted, &pose).ok().filter(|grasp| grasp.measure >= LEAST)
    })?;
    let known = known.object_from_palm;
    let rotation = known.rotation;
    let pose = [rotation.w, rotation.i, rotation.j, rotation.k];
    let contacts = wanted.contacts.iter().map(|contact| {
        json!({
            "finger": contact.finger.name(),
            "point": rounded(contact.point.iter()),
            "normal": rounded(contact.normal.iter()),
        })
    });
    Some(json!({
        "seed": seed,
        "shape": shape,
        "contacts": contacts.collect::<Vec<_>>(),
        "known": rounded(known.translation.vector.iter().chain(&pose)),
    }))
}

fn rounded<'a>(values: impl Iterator<Item = &'a f64>) -> Vec<f64> {
    values.map(|value| (value * 1e9).round() / 1e9).collect()
}

fn known(grasp: &Value) -> Isometry3<f64> {
    let n = numbers(&grasp["known"]);
    teachtree_base::geometry::pose([n[0], n[1], n[2]], [n[3], n[4], n[5], n[6]])
}

/// Returns the processor time of this thread, s, which other work on the machine does not affect; the time of day where the system has no such clock.
fn on_processor() -> f64 {
    let printed = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let printed = printed.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    printed
        .map_or_else(|| SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |it| it.as_secs_f64()), |ns| ns * 1e-9)
}

fn measure(hand: &HandModel, (name, criterion, key, _): &Criterion) {
    let planner = GraspPlanner::with_criterion(hand, *criterion);
    let list = listed();
    let (mut ratios, mut times, mut failed, mut efforts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for grasp in &list {
        let (object, contacts) = read(grasp);
        let wanted = GraspRequest { contacts, object: &object, obstacles: Vec::new() };
        let (mapped, effort) = planner.map_counted(&wanted).expect("the hand has these fingers");
        efforts.push(effort);
        let begun = on_processor();
        let mut rounds = 0.0;
        while rounds == 0.0 || on_processor() - begun < LONG_S {
            assert_eq!(planner.map(&wanted), mapped, "the same problem has the same solution");
            rounds += 1.0;
        }
        times.push((on_processor() - begun) / rounds * 1e3);
        let reference = grasp[*key].as_f64().expect("a number");
        match mapped {
            Ok(mapped) => ratios.push((mapped.measure / reference, grasp["seed"].as_u64())),
            Err(why) => failed.push(format!("seed {}: {why} (reference {reference})", grasp["seed"])),
        }
    }
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    times.sort_by(f64::total_cmp);
    let share =
        |least: f64| 100.0 * ratios.iter().filter(|(ratio, _)| *ratio >= least).count() as f64 / list.len() as f64;
    println!("by {name}");
    println!("grasps                       {}", list.len());
    println!("found                        {:.1} %", 100.0 * ratios.len() as f64 / list.len() as f64);
    println!("measure >= 0.98 of reference {:.1} %", share(0.98));
    println!("measure >= 0.90 of reference {:.1} %", share(0.90));
    println!("lowest                       {:.3?}", ratios.iter().take(6).collect::<Vec<_>>());
    println!(
        "median time                  {:.1} ms, 95 % {:.1} ms",
        times[times.len() / 2],
        times[times.len() * 95 / 100]
    );
    let of = |count: &dyn Fn(&SearchEffort) -> u64| {
        let mut counts: Vec<u64> = efforts.iter().map(count).collect();
        counts.sort_unstable();
        counts[counts.len() / 2]
    };
    println!(
        "median number of looks       {} at the cost, {} at its slope as well, {} at what fingers miss",
        of(&|it| it.costs),
        of(&|it| it.slopes),
        of(&|it| it.fits)
    );
    for line in failed {
        println!("not found: {line}");
    }
}
