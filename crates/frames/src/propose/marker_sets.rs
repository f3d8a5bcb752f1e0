//! Markers of one body: points whose names share a stem, and that keep their distances.

use super::bodies::Body;
use super::parts::{Part, Quantity, distance, distances};
use super::quantiles::{median, quantile};
use super::words;
use std::collections::BTreeSet;

/// How much the distance of two markers of one body varies, m, or as a share of the distance: bodies are soft, and trackers scatter.
const VARIES_M: f64 = 0.005;
const VARIES: f64 = 0.2;
/// The share of a log that is its beginning, and its end.
const END: f64 = 0.02;
/// The largest distance of markers of one body, m.
const WIDEST_M: f64 = 0.4;
/// The least number of markers on a body that stands still: two things at rest keep their distance too.
const STILL: usize = 3;
/// Words for markers, and for their places on a body.
const PLACES: [&str; 19] = [
    "m", "marker", "mk", "mkr", "pt", "point", "top", "bottom", "left", "right", "front", "back", "rear", "middle",
    "center", "centre", "upper", "lower", "corner",
];

/// The subject that the names of all positions have before a colon, as Vicon writes it, with the colon; none if nothing but labels of markers follow.
pub fn common_subject(parts: &[Part]) -> Option<String> {
    let positions = parts.iter().filter(|part| part.quantity == Quantity::Position);
    let pairs: Option<Vec<(&str, &str)>> = positions.map(|part| part.name.split_once(':')).collect();
    let pairs = pairs?;
    let (subject, _) = *pairs.first()?;
    let is_named = |label: &str| words::numbered_body(label).is_some_and(|name| !name.split('_').all(is_label));
    let is_common = pairs.iter().all(|(other, _)| *other == subject) && pairs.iter().any(|(_, label)| is_named(label));
    is_common.then(|| format!("{subject}:"))
}

/// Whether a log has points of a motion capture: names of subjects or of markers, and no rotation.
pub fn are_markers(parts: &[Part]) -> bool {
    let mut positions = parts.iter().filter(|part| part.quantity == Quantity::Position).peekable();
    let is_marker = |part: &Part| part.name.contains(':') || words::has(&part.words, &["marker", "markers"]);
    positions.peek().is_some()
        && positions.all(is_marker)
        && parts.iter().all(|part| part.quantity != Quantity::Rotation)
}

/// The name of a body in that of one of its markers: `glass` of `glass_1`, `glass_m1`, `glass_A` and `glass1`, `pillow` of `pillow_top`.
pub fn stem(name: &str) -> Option<String> {
    let tokens: Vec<&str> = name.split('_').collect();
    let kept = tokens.iter().rposition(|token| !is_label(token))? + 1;
    let mut stem: Vec<&str> = tokens.get(..kept)?.to_vec();
    let is_labeled = kept < tokens.len();
    let last = stem.pop()?;
    let short = if is_labeled { last } else { last.trim_end_matches(|letter: char| letter.is_ascii_digit()) };
    // `glass:glass1`
    if stem.last() != Some(&short) {
        stem.push(short);
    }
    (is_labeled || short.len() < last.len()).then(|| stem.join("_"))
}

/// Whether a part of a name counts markers or says where one is: `3`, `A`, `m1`, `top`.
fn is_label(token: &str) -> bool {
    let letters = token.trim_end_matches(|letter: char| letter.is_ascii_digit()).to_lowercase();
    letters.len() < 2 || PLACES.contains(&letters.as_str())
}

/// Returns the bodies without the markers of those whose rotation is in the log too, and these markers. A tracker exports the pose of a rigid body and, if asked,
/// the points from which it was computed.
pub fn without_markers_of_rigid_bodies(bodies: Vec<Body<'_>>) -> (Vec<Body<'_>>, Vec<Part<'_>>) {
    let rigid: Vec<Body> = bodies.iter().filter(|body| body.rotation.is_some()).cloned().collect();
    let of = |marker: &Body| {
        let stem = stem(&marker.name).filter(|_| marker.rotation.is_none())?;
        rigid.iter().find(|body| body.name == stem && are_rigid(body, marker)).map(|body| body.name.clone())
    };
    let (mut kept, mut markers) = (vec![], vec![]);
    for body in bodies {
        let Some(name) = of(&body) else {
            kept.push(body);
            continue;
        };
        markers.extend(body.positions.into_iter().map(|mut part| {
            part.quantity = Quantity::Other;
            part.left_out = Some(format!("a marker of {name}, whose pose is in the log"));
            part
        }));
    }
    (kept, markers)
}

/// Returns the bodies without second measurements of one body, and these: names that differ in their source only, of points that stay together while they move.
pub fn without_second_sources(bodies: Vec<Body<'_>>) -> (Vec<Body<'_>>, Vec<Part<'_>>) {
    let known = bodies.clone();
    let first = |at: usize, body: &Body| {
        let is_twin = |other: &Body| {
            let is_same = words::without_source(&other.name) == words::without_source(&body.name);
            is_same && other.moves() && body.moves() && are_together(body, other)
        };
        let is_before = |(place, other): &(usize, &Body)| (other.name.len(), *place) < (body.name.len(), at);
        known
            .iter()
            .enumerate()
            .filter(is_before)
            .find(|(_, other)| is_twin(other))
            .map(|(_, other)| other.name.clone())
    };
    let (mut kept, mut others) = (vec![], vec![]);
    for (at, body) in bodies.into_iter().enumerate() {
        match first(at, &body) {
            None => kept.push(body),
            Some(name) => {
                let left_out = Some(format!("another measurement of {name}"));
                let parts = body.positions.into_iter().chain(body.rotation);
                others.extend(parts.map(|part| Part { quantity: Quantity::Other, left_out: left_out.clone(), ..part }));
            }
        }
    }
    (kept, others)
}

/// Whether two bodies mostly stay within a small distance.
fn are_together(one: &Body, other: &Body) -> bool {
    const APART_M: f64 = 0.05;
    let firsts = one.positions.first().zip(other.positions.first());
    firsts.is_some_and(|(one, other)| quantile(distances(one, other), 0.95).is_some_and(|most| most < APART_M))
}

/// Bodies that may be one.
struct Set<'a> {
    /// The name of the body; that of its first marker if it is the only one.
    name: String,
    bodies: Vec<Body<'a>>,
}

/// Bodies with the markers of one body put together. `are_markers` says that the log has points of a motion capture.
pub fn merged(bodies: Vec<Body<'_>>, are_markers: bool) -> Vec<Body<'_>> {
    let has_still = are_markers || has_moving_set(&bodies);
    let sets = bodies.into_iter().map(|body| Set { name: body.name.clone(), bodies: vec![body] }).collect();
    let by_stem = gathered(sets, |set| stem(&set.name), has_still);
    // What is left of a name may be any label, where the points move as one.
    let first = |set: &Set| set.name.split_once('_').map(|(first, _)| first.to_string());
    let by_first = gathered(by_stem, |set| first(set).or_else(|| Some(set.name.clone())), false);
    let mut taken: BTreeSet<String> =
        by_first.iter().filter(|set| set.bodies.len() == 1).map(|set| set.name.clone()).collect();
    let mut all = vec![];
    for Set { name, bodies } in by_first {
        let is_one = bodies.len() >= STILL || bodies.iter().all(Body::moves);
        let sets: Vec<(String, Vec<Body>)> = match () {
            () if is_one && bodies.len() > 1 && !taken.contains(&name) => vec![(name, bodies)],
            () if is_one => {
                bodies.first().map(|first| first.name.clone()).map(|name| (name, bodies)).into_iter().collect()
            }
            () => bodies.into_iter().map(|body| (body.name.clone(), vec![body])).collect(),
        };
        for (name, bodies) in sets {
            taken.insert(name.clone());
            let rotation = bodies.iter().find_map(|body| body.rotation.clone());
            all.push(Body { name, positions: bodies.into_iter().flat_map(|body| body.positions).collect(), rotation });
        }
    }
    all
}

/// Whether points with numbers move as one body: then points with numbers are markers in this log.
fn has_moving_set(bodies: &[Body]) -> bool {
    let points: Vec<(String, &Body)> = bodies
        .iter()
        .filter(|body| body.rotation.is_none() && body.moves())
        .filter_map(|body| Some((stem(&body.name)?, body)))
        .collect();
    let is_set = |(at, (stem, body)): (usize, &(String, &Body))| {
        points.iter().skip(at + 1).any(|(other, next)| other == stem && are_rigid(body, next))
    };
    points.iter().enumerate().any(is_set)
}

/// The sets with those of one name put together, if they have no rotation and keep their distances. Points at rest count if `has_still`.
fn gathered<'a>(sets: Vec<Set<'a>>, name: impl Fn(&Set) -> Option<String>, has_still: bool) -> Vec<Set<'a>> {
    let is_free = |set: &Set| set.bodies.iter().all(|body| body.rotation.is_none() && (has_still || body.moves()));
    let mut all: Vec<(Option<String>, Set<'a>)> = vec![];
    for set in sets {
        let name = name(&set).filter(|_| is_free(&set));
        let known = all.iter_mut().find(|(other, known)| {
            other.is_some()
                && *other == name
                && known.bodies.iter().all(|one| set.bodies.iter().all(|next| are_rigid(one, next)))
        });
        match known {
            Some((Some(name), known)) => {
                known.name.clone_from(name);
                known.bodies.extend(set.bodies);
            }
            _ => all.push((name, set)),
        }
    }
    all.into_iter().map(|(_, set)| set).collect()
}

/// Whether the markers of two bodies keep their distances.
fn are_rigid(one: &Body, other: &Body) -> bool {
    one.positions.iter().all(|one| other.positions.iter().all(|other| is_rigid(one, other)))
}

/// Whether the distance of two markers is the same in most rows, and in the first and the last ones: one of two things may move alone there. A marker in the origin
/// is lost.
pub fn is_rigid(one: &Part, other: &Part) -> bool {
    let seen = |part: &Part, row: usize| part.position(row).filter(|at| *at != [0.0; 3]);
    let distances: Vec<f64> = (0..one.rows())
        .filter_map(|row| Some(distance(seen(one, row)?, seen(other, one.row_in(row, other))?)))
        .collect();
    let at = |share: f64| quantile(distances.clone(), share).unwrap_or_default();
    let varies_m = (VARIES * at(0.5)).max(VARIES_M);
    let end = (distances.len() as f64 * END).ceil() as usize;
    let ends = [distances.get(..end), distances.get(distances.len() - end..)];
    let is_usual = |end: &[f64]| median(end.to_vec()).is_some_and(|there| (there - at(0.5)).abs() < varies_m);
    at(0.9) - at(0.1) < varies_m && at(0.5) < WIDEST_M && ends.into_iter().flatten().all(is_usual)
}
