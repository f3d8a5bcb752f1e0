//! What carries the objects of a log: bodies that never move and that things rest on, a table, and what else things rest on. Heights follow from where things
//! rest; every body is taken for as high as it stands above the table.

use super::Survey;
use super::bodies::Body;
use super::rests::Rest;
use super::words;
use std::collections::BTreeMap;

/// Rests whose heights differ by less are at one height, m.
const LEVEL_M: f64 = 0.004;
/// Largest height of a body that its rest position implies, m.
const HIGHEST_M: f64 = 0.3;
/// A table is at most this far below where what rests on it seems to end, m.
const LOWER_M: f64 = 0.1;
/// The usual width of what carries things, m, and that of a table.
const WIDTH_M: f64 = 0.3;
const TABLE_M: f64 = 2.0;
/// The thickness of what carries things, m.
pub const THICK_M: f64 = 0.02;
/// How far from the middle of a body that never moves a thing rests on it, m, if no name says that it carries things.
const ON_M: f64 = 0.06;
/// How far a thing on another one may be beside it, m.
const STACKED_M: f64 = 0.04;

/// A level surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Its middle, m: of a body from its origin, else in the log.
    pub top: [f64; 3],
    /// Its edge, m.
    pub width_m: f64,
    /// What rests on it.
    pub carries: String,
    /// How far that is taken to reach below its origin, m.
    pub below_m: f64,
}

/// What carries the objects of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Supports {
    /// How far bodies that stand on the table reach below their origins, m, where that is farther than their shapes show.
    pub below_m: BTreeMap<String, f64>,
    /// How far above the table bodies are that never move, m.
    pub standing_m: BTreeMap<String, f64>,
    /// The tops of bodies that never move.
    pub of_bodies: BTreeMap<String, Surface>,
    /// The top of the table, if the log has none that carries everything.
    pub table: Option<Surface>,
    /// Other places where things rest.
    pub others: Vec<Surface>,
}

/// What a thing rests on.
enum On<'a> {
    Body(&'a str),
    Thing,
    Unknown,
}

impl Supports {
    /// What carries the objects of a log whose bodies are boxes with this edge, m; others reach as far below their origins as `shown_m` says, m.
    pub fn new(survey: &Survey, edge_m: f64, shown_m: &BTreeMap<String, f64>) -> Self {
        let shown = |body: &str| shown_m.get(body).copied().unwrap_or(edge_m / 2.0);
        let is_carried = |rest: &Rest| is_in_socket(survey, rest) || survey.fixed.contains_key(&rest.body);
        let rests: Vec<Rest> = rests(survey).into_iter().filter(|rest| !is_carried(rest)).collect();
        let mut found = Self::default();
        let mut on_bodies: BTreeMap<&str, Vec<&Rest>> = BTreeMap::new();
        let mut free: Vec<&Rest> = vec![];
        for rest in &rests {
            match on(survey, rest, edge_m) {
                On::Body(body) => on_bodies.entry(body).or_default().push(rest),
                On::Thing => {}
                On::Unknown => free.push(rest),
            }
        }
        let mut lowest: BTreeMap<&str, f64> = BTreeMap::new();
        for rest in &free {
            let height = lowest.entry(&rest.body).or_insert(f64::INFINITY);
            *height = height.min(rest.at[2]);
        }
        let top = lowest.iter().map(|(body, height)| height - shown(body)).fold(f64::INFINITY, f64::min);
        // The lowest point of what is held is unknown: a marker that never moves is on the table too.
        let never_move = survey.bodies.iter().filter(|body| !shown_m.is_empty() && !body.moves());
        let markers = never_move.filter_map(|body| Some(survey.at(&body.name)?[2] - THICK_M / 2.0));
        let top = markers.filter(|height| (top - LOWER_M..top).contains(height)).fold(top, f64::min);
        for (body, height) in lowest {
            let below = height - top;
            if below - shown(body) > LEVEL_M && below * 2.0 < HIGHEST_M {
                found.below_m.insert(body.to_string(), below);
            }
        }
        for body in survey.bodies.iter().filter(|body| !body.moves()) {
            let height = survey.at(&body.name).map(|at| at[2] - top).filter(|height| (0.0..HIGHEST_M).contains(height));
            found.standing_m.extend(height.map(|height| (body.name.clone(), height)));
        }
        // What rests on one body reaches as far down.
        for carried in on_bodies.values() {
            let height = carried.iter().map(|rest| rest.at[2] - shown(&rest.body)).fold(f64::INFINITY, f64::min);
            for rest in carried {
                let least =
                    carried.iter().filter(|it| it.body == rest.body).map(|it| it.at[2]).fold(f64::INFINITY, f64::min);
                let below = least - height;
                if below - shown(&rest.body) > LEVEL_M && below * 2.0 < HIGHEST_M {
                    found.below_m.entry(rest.body.clone()).or_insert(below);
                }
            }
        }
        let bottom =
            |rest: &Rest| rest.at[2] - found.below_m.get(&rest.body).copied().unwrap_or_else(|| shown(&rest.body));
        let (mut of_bodies, mut others, mut table) = (BTreeMap::new(), vec![], None);
        for (body, carried) in on_bodies {
            let (Some(origin), Some(first)) = (survey.at(body), carried.first()) else { continue };
            let height = carried.iter().map(|rest| bottom(rest)).fold(f64::INFINITY, f64::min);
            let others = rests.iter().filter(|rest| !carried.contains(rest) && bottom(rest) < height - LEVEL_M);
            let room = others.map(|rest| beside(rest.at, origin)).fold(f64::INFINITY, f64::min) - edge_m;
            let farthest = carried.iter().map(|rest| beside(rest.at, origin)).fold(0.0, f64::max);
            let usual = if is_table(body) { TABLE_M } else { WIDTH_M.min(2.0 * room) };
            let width_m = usual.max(2.0 * farthest + edge_m);
            let (top, below_m) = ([0.0, 0.0, height - origin[2]], first.at[2] - bottom(first));
            of_bodies.insert(body.to_string(), Surface { top, width_m, carries: first.body.clone(), below_m });
        }
        for rest in &free {
            let height = bottom(rest);
            let below_m = rest.at[2] - height;
            let surface = |width_m: f64, top: [f64; 3]| Surface { top, width_m, carries: rest.body.clone(), below_m };
            if height - top <= LEVEL_M {
                table.get_or_insert_with(|| surface(TABLE_M, [0.0, 0.0, top]));
                continue;
            }
            let is_known = |known: &Surface| {
                beside(known.top, rest.at) < known.width_m / 2.0 && (known.top[2] - height).abs() < LEVEL_M
            };
            if !others.iter().any(is_known) {
                let below = rests.iter().filter(|other| bottom(other) < height - LEVEL_M);
                let room = below.map(|other| beside(other.at, rest.at)).fold(f64::INFINITY, f64::min) - edge_m;
                // Where its object passes lower, it is not.
                let clear_m = rest.clear_m - edge_m / 2.0 - LEVEL_M;
                let width_m = (WIDTH_M / 2.0).min(2.0 * room).min(2.0 * clear_m).max(edge_m);
                others.push(surface(width_m, [rest.at[0], rest.at[1], height]));
            }
        }
        Self { of_bodies, others, table, ..found }
    }
}

/// The rests of a bound log; before, the places where bodies begin.
fn rests(survey: &Survey) -> Vec<Rest> {
    if !survey.rests.is_empty() {
        return survey.rests.clone();
    }
    let moving = survey.bodies.iter().filter(|body| body.moves());
    let others = |name: &str| {
        let others = survey.bodies.iter().filter(|other| other.name != name);
        others.filter_map(|other| Some((other.name.clone(), survey.at(&other.name)?))).collect()
    };
    let rest = |body: &Body| {
        Some(Rest {
            body: body.name.clone(),
            at: survey.at(&body.name)?,
            clear_m: f64::INFINITY,
            others: others(&body.name),
        })
    };
    moving.filter_map(rest).collect()
}

/// The distance beside a point, m.
fn beside(one: [f64; 3], other: [f64; 3]) -> f64 {
    (one[0] - other[0]).hypot(one[1] - other[1])
}

/// Whether a name is that of something on which everything stands.
fn is_table(body: &str) -> bool {
    words::has(&words::words(body), &["table", "desk", "ground", "floor", "surface"])
}

/// Whether a thing rests in a socket.
fn is_in_socket(survey: &Survey, rest: &Rest) -> bool {
    const BESIDE_M: f64 = 0.03;
    survey.sockets.iter().filter(|socket| socket.object == rest.body).any(|socket| {
        let origin = socket.of.as_ref().and_then(|of| survey.at(of));
        let [x, y, z] = socket.rim;
        let (from, reach) = match origin {
            // The body may be turned.
            Some(origin) => (origin, (x * x + y * y + z * z).sqrt()),
            None => (socket.rim, 0.0),
        };
        super::parts::distance(from, rest.at) < reach + socket.depth_m + BESIDE_M
    })
}

/// What a thing rests on: a thing below it, else the nearest body that never moves and is named so or right below it.
fn on<'a>(survey: &'a Survey, rest: &Rest, edge_m: f64) -> On<'a> {
    let mut nearest: Option<(f64, &str)> = None;
    for body in survey.bodies.iter().filter(|body| body.name != rest.body) {
        let Some(at) = rest.others.get(&body.name) else { continue };
        let (beside, above) = (beside(*at, rest.at), rest.at[2] - at[2]);
        let is_fixed = survey.sockets.iter().any(|socket| socket.of.as_ref() == Some(&body.name))
            || survey.bearings.iter().any(|bearing| bearing.of.as_ref() == Some(&body.name))
            || survey.fixed.contains_key(&body.name);
        // As far above as two bodies of one size are.
        let is_stacked = (above - edge_m).abs() < 0.1 * edge_m;
        let is_carrier = words::is_support(&body.name) && !body.moves();
        // What a hand keeps in place is an object too.
        let is_handled =
            body.moves() || survey.hold_points.values().any(|hold| hold.object.as_ref() == Some(&body.name));
        if !is_carrier && beside < STACKED_M && (is_stacked || is_handled && above > edge_m / 2.0) {
            return On::Thing;
        }
        let reach = match () {
            () if is_carrier && is_table(&body.name) => f64::INFINITY,
            () if is_carrier => WIDTH_M / 2.0,
            () => ON_M,
        };
        let is_on = beside < reach && above > -ON_M && (reach > WIDTH_M || above < WIDTH_M);
        // A table is what is left.
        let far = if reach > WIDTH_M { reach } else { beside };
        if !is_handled && !is_fixed && is_on && nearest.is_none_or(|(known, _)| far < known) {
            nearest = Some((far, &body.name));
        }
    }
    nearest.map_or(On::Unknown, |(_, body)| On::Body(body))
}
