//! `rules/single_hand.rules` with `rules/contact.rules` and `rules/hand_force.rules`, translated by hand: one loop over rows that runs ahead of the
//! labels by the look-ahead of the rules, and keeps the rows as words of bits. Labels are positions in [`LABELS`].
//!
//! A row becomes a word of bits ([`HysteresisState`]); contacts that flicker are bridged ([`WindowCounters`]) with a delay; while no bit changes, the label is
//! kept without evaluating the tree ([`TreeState`]).
#![allow(clippy::needless_range_loop, reason = "plain loops over arrays of known length make the fastest code here")]

use super::rows::Row;
use crate::job::baseline::{Float, Runs, append, square};

/// The primitives.
pub const LABELS: [&str; 14] = [
    "Move",
    "Approach",
    "Grasp",
    "Translate",
    "Slide",
    "Insert",
    "Pullout",
    "Release",
    "Place",
    "Turn",
    "Press",
    "Follow",
    "Push",
    "Trace",
];
const MOVE: u8 = 0;
const APPROACH: u8 = 1;
const GRASP: u8 = 2;
const TRANSLATE: u8 = 3;
const SLIDE: u8 = 4;
const INSERT: u8 = 5;
const PULLOUT: u8 = 6;
const RELEASE: u8 = 7;
const PLACE: u8 = 8;
const TURN: u8 = 9;
const PRESS: u8 = 10;
const FOLLOW: u8 = 11;
const PUSH: u8 = 12;
const TRACE: u8 = 13;
/// Before the first frame.
const NONE: u8 = 14;

// Bits of a row. The first eight are bridged: five fingertips, then three of the contacts.
const SLIDING: u32 = 1 << 5;
const BORNE: u32 = 1 << 6;
const BESIDE: u32 = 1 << 7;
const NEAR: u32 = 1 << 8;
const MOVING: u32 = 1 << 9;
const TURNING: u32 = 1 << 10;
const INSERTED: u32 = 1 << 11;
const SINKS: u32 = 1 << 12;
const RISES: u32 = 1 << 13;
const OVER_SOCKET: u32 = 1 << 14;
const IN_PLAIN_SOCKET: u32 = 1 << 15;
const BEARS_DOWN: u32 = 1 << 16;
const ALONG_WALL: u32 = 1 << 17;
const SQUEEZED: u32 = 1 << 18;
/// The target differs from that of the previous frame.
const CHANGED: u32 = 1 << 19;
// Bits computed from the following frames.
const LETS_GO: u32 = 1 << 20;
const COMES_TO_REST: u32 = 1 << 21;
const EASES_OFF: u32 = 1 << 22;

/// The bits that restart with another target.
const OF_TARGET: u32 = NEAR | MOVING | TURNING | INSERTED;
/// A frame after the end, on which no condition holds.
const BEHIND: u32 = 0;

const TOUCHES: u32 = 0b1_1111;
const THUMB: u32 = 1;
const OPPOSING: u32 = 0b1_1110;
const BRIDGED: u32 = 0xff;

// Durations in frames of 1 ms. Tremor and flicker are equally long.
const BRIDGE: usize = 130;
const RELEASE_WINDOW: usize = 250;
const PUSH_TIME: usize = 350;
const PRESS_TIME: usize = 250;
const LIFT_TIME: u32 = 100;
const PLACE_TIME: u32 = 150;

/// Frames by which bridges, and rows, run ahead of labels.
const BRIDGES_AHEAD: usize = RELEASE_WINDOW - 1;
const ROWS_AHEAD: usize = BRIDGES_AHEAD + BRIDGE - 1;
/// Size of the ring buffer: a power of two above `ROWS_AHEAD`.
const RING: usize = 512;

/// State of the hystereses.
struct HysteresisState {
    kept: u32,
    target: f32,
    /// A bit for each contact: whether it bears a force, and whether the target moves along it.
    loads: u32,
    along: u32,
}

impl HysteresisState {
    #[inline(always)]
    fn step<T: Float, const CONTACTS: usize>(&mut self, row: &Row<CONTACTS>) -> u32 {
        let constant = |value: f64| T::of(value);
        let bit = |bit: u32, is: bool| if is { bit } else { 0 };
        let mut changed = 0;
        if row.target.to_bits() != self.target.to_bits() {
            *self = Self { kept: self.kept & !OF_TARGET, target: row.target, loads: 0, along: 0 };
            changed = CHANGED;
        }

        let mut touch = 0;
        let (mut px, mut py, mut pz) = (T::default(), T::default(), T::default());
        let (mut fx, mut fy, mut fz) = (T::default(), T::default(), T::default());
        // Eight square roots in one instruction take no longer than two: five of fingers, one of their sum.
        let mut squares = [T::default(); 8];
        let mut pressed = T::default();
        for finger in 0..5 {
            touch |= u32::from(row.touch[finger] > 0.5) << finger;
            px = px + T::from(row.tips[0][finger]);
            py = py + T::from(row.tips[1][finger]);
            pz = pz + T::from(row.tips[2][finger]);
            let (x, y, z) =
                (T::from(row.forces[0][finger]), T::from(row.forces[1][finger]), T::from(row.forces[2][finger]));
            (fx, fy, fz) = (fx + x, fy + y, fz + z);
            squares[finger] = square(x, y, z);
            pressed = pressed + squares[finger];
        }
        let fifth = constant(0.2);
        let distance = square(
            px * fifth - T::from(row.position[0]),
            py * fifth - T::from(row.position[1]),
            pz * fifth - T::from(row.position[2]),
        );
        let radius = T::from(row.radius);
        let (near_on, near_off) = (radius + constant(0.05), radius + constant(0.07));
        // The squeeze is at most half the sum of the forces, so small forces need no further test.
        let (mut squeeze_on, mut squeeze_keep) = (false, false);
        if pressed > constant(0.007) {
            squares[5] = square(fx, fy, fz);
            let mut norms = squares;
            for norm in &mut norms {
                *norm = norm.root();
            }
            let twice = norms[0] + norms[1] + norms[2] + norms[3] + norms[4] - norms[5];
            (squeeze_on, squeeze_keep) = (twice > constant(0.6), twice >= constant(0.2));
        }

        let (vx, vy, vz) = (T::from(row.velocity[0]), T::from(row.velocity[1]), T::from(row.velocity[2]));
        let speed = square(vx, vy, vz);
        let (spin, depth, down) = (T::from(row.spin.abs()), T::from(row.depth), T::from(-row.push_up));
        let on = bit(NEAR, distance < near_on * near_on)
            | bit(MOVING, speed > constant(0.01 * 0.01))
            | bit(TURNING, spin > constant(0.3))
            | bit(INSERTED, depth > constant(0.002))
            | bit(BEARS_DOWN, down > constant(0.8))
            | bit(SQUEEZED, squeeze_on);
        let keep = bit(NEAR, distance <= near_off * near_off)
            | bit(MOVING, speed >= constant(0.005 * 0.005))
            | bit(TURNING, spin >= constant(0.15))
            | bit(INSERTED, depth >= constant(0.001))
            | bit(BEARS_DOWN, down >= constant(0.6))
            | bit(SQUEEZED, squeeze_keep);
        self.kept = on | self.kept & keep;

        let (mut on, mut keep, mut slips_on, mut slips_keep) = (0_u32, 0_u32, 0_u32, 0_u32);
        let (mut carries, mut handled) = (0_u32, 0_u32);
        for at in 0..CONTACTS {
            let [force, normal, velocity] = [&row.contact_forces, &row.normals, &row.velocities];
            let force = square(T::from(force[0][at]), T::from(force[1][at]), T::from(force[2][at]));
            let (nx, ny, nz) = (T::from(normal[0][at]), T::from(normal[1][at]), T::from(normal[2][at]));
            let wx = vx - T::from(velocity[0][at]);
            let wy = vy - T::from(velocity[1][at]);
            let wz = vz - T::from(velocity[2][at]);
            let across = wx * nx + wy * ny + wz * nz;
            let slip = square(wx - nx * across, wy - ny * across, wz - nz * across);
            on |= u32::from(force > constant(0.05 * 0.05)) << at;
            keep |= u32::from(force >= constant(0.02 * 0.02)) << at;
            slips_on |= u32::from(slip > constant(0.01 * 0.01)) << at;
            slips_keep |= u32::from(slip >= constant(0.005 * 0.005)) << at;
            carries |= u32::from(nz > constant(0.7)) << at;
            handled |= u32::from(row.handled[at] > 0.5) << at;
        }
        self.loads = on | self.loads & keep;
        self.along = slips_on | self.along & slips_keep;
        let (below, aside) = (self.loads & carries, self.loads & !carries);

        let sinking = T::from(row.sinking);
        touch
            | self.kept
            | changed
            | bit(SLIDING, below & self.along != 0)
            | bit(BORNE, below & !handled != 0)
            | bit(BESIDE, aside & !handled != 0)
            | bit(ALONG_WALL, aside & self.along != 0)
            | bit(SINKS, sinking > constant(0.005))
            | bit(RISES, sinking < constant(-0.005))
            | bit(OVER_SOCKET, row.over_socket > 0.5)
            | bit(IN_PLAIN_SOCKET, row.in_plain_socket > 0.5)
    }
}

/// `bridging`: for each bit, the number of frames until it expires.
#[derive(Default)]
struct WindowCounters {
    last: [u8; 8],
    next: [u8; 8],
    /// The last words, behind and ahead, and the number of frames until the last expiry.
    seen: (u32, u32),
    busy: usize,
    /// The bridged bits.
    bits: u32,
}

impl WindowCounters {
    /// Processes the frame that is `BRIDGE - 1` ahead.
    #[inline(always)]
    fn ahead(&mut self, row: u32) {
        if row & BRIDGED != self.seen.1 {
            self.seen.1 = row & BRIDGED;
            self.busy = BRIDGE + 1;
        }
        if self.busy > 0 {
            count_down(&mut self.next, row);
        }
    }

    /// Returns the bridged bits of the current frame.
    #[inline(always)]
    fn step(&mut self, row: u32) -> u32 {
        if row & (BRIDGED | CHANGED) != self.seen.0 {
            self.seen.0 = row & (BRIDGED | CHANGED);
            self.busy = BRIDGE + 1;
        }
        if self.busy > 0 {
            self.busy -= 1;
            if row & CHANGED != 0 {
                self.last[5..].fill(0);
            }
            count_down(&mut self.last, row);
            let mut bits = 0;
            for at in 0..8 {
                bits |= if self.last[at].min(self.next[at]) > 0 { LANES[at] } else { 0 };
            }
            self.bits = u32::from(bits);
        }
        self.bits
    }
}

/// Spreads eight bits over eight bytes, so that all are processed at once.
const LANES: [u8; 8] = [1, 2, 4, 8, 16, 32, 64, 128];

#[inline(always)]
fn count_down(left: &mut [u8; 8], row: u32) {
    for at in 0..8 {
        left[at] = if row as u8 & LANES[at] != 0 { BRIDGE as u8 } else { left[at].saturating_sub(1) };
    }
}

/// Latches, the counters of `for`, and the label.
#[derive(Clone, Copy, PartialEq)]
struct TreeState {
    label: u8,
    touches: u32,
    leaving: bool,
    lifted: bool,
    placed: bool,
    pushed: bool,
    pressing: bool,
    wall_before: bool,
    /// Frames in the air, and frames of `Place`, up to the required numbers.
    in_air: u32,
    placing: u32,
}

impl TreeState {
    const START: Self = Self {
        label: NONE,
        touches: 0,
        leaving: false,
        lifted: false,
        placed: false,
        pushed: false,
        pressing: false,
        wall_before: false,
        in_air: 0,
        placing: 0,
    };

    /// Returns the state after a frame; `bits` are those of the row, bridged, with those of the following frames.
    #[inline(always)]
    fn step(&self, bits: u32) -> Self {
        let is = |bit: u32| bits & bit != 0;
        let from = |labels: u32| labels >> self.label & 1 != 0;
        let unmoved = from(1 << NONE | 1 << MOVE | 1 << APPROACH);

        let touches = bits & TOUCHES;
        let before = if self.label == NONE { touches } else { self.touches };
        let touching = touches != 0;
        let grasped = is(THUMB) && is(OPPOSING) && is(SQUEEZED);
        let (slid, supported, walled, moving) = (is(SLIDING), is(BORNE), is(BESIDE), is(MOVING));
        let (inserted, turning) = (is(INSERTED), is(TURNING));
        let screwing = turning && !is(IN_PLAIN_SOCKET);

        // Bits that depend on the target restart with another one.
        let kept = if is(CHANGED) {
            Self { lifted: false, placed: false, pushed: false, wall_before: false, in_air: 0, ..*self }
        } else {
            *self
        };
        let in_air = if grasped && !supported && !inserted { (kept.in_air + 1).min(LIFT_TIME) } else { 0 };
        let placing = if from(1 << PLACE) { (kept.placing + 1).min(PLACE_TIME) } else { 0 };
        let leaving = touching && touches & !before == 0 && (kept.leaving || before & !touches != 0 && is(LETS_GO));
        let lifted = touching && (kept.lifted || in_air == LIFT_TIME);
        let placed = supported && (kept.placed || placing == PLACE_TIME);
        let pushed = moving && (kept.pushed || !is(COMES_TO_REST));
        let pressing = is(BEARS_DOWN) && (kept.pressing || !is(EASES_OFF));
        let apart = unmoved || from(1 << RELEASE) || lifted && !placed;
        let wall_before = walled && supported && (kept.wall_before || grasped && apart);

        let label = if !touching {
            match () {
                () if unmoved && is(NEAR) => APPROACH,
                () if unmoved => MOVE,
                () if is(NEAR) || !from(1 << RELEASE) => RELEASE,
                () => MOVE,
            }
        } else if leaving && !unmoved {
            RELEASE
        } else if inserted {
            match () {
                () if screwing => TURN,
                () if is(SINKS) => INSERT,
                () if is(RISES) => PULLOUT,
                () if from(1 << INSERT | 1 << PULLOUT | 1 << TURN) => self.label,
                () if grasped && !from(1 << TRANSLATE) => GRASP,
                () if from(1 << NONE | 1 << MOVE) => APPROACH,
                () => self.label,
            }
        } else if !grasped {
            match () {
                () if moving && walled => TRACE,
                () if pushed && supported => PUSH,
                () if from(1 << NONE | 1 << MOVE) => APPROACH,
                () => self.label,
            }
        } else if turning && (supported || walled) {
            TURN
        } else if !supported && !walled || lifted && is(OVER_SOCKET) {
            TRANSLATE
        } else if lifted && supported && pressing && !slid {
            PRESS
        } else if walled && !wall_before && !(lifted && supported && !placed) {
            if is(ALONG_WALL) { FOLLOW } else { PRESS }
        } else {
            match () {
                () if lifted && !placed => PLACE,
                () if moving && slid => SLIDE,
                () if lifted => PLACE,
                () => GRASP,
            }
        };
        Self { label, touches, leaving, lifted, placed, pushed, pressing, wall_before, in_air, placing }
    }
}

/// Frames after which the last true bit has expired.
struct LookAhead {
    window: usize,
    left: usize,
}

impl LookAhead {
    const fn new(window: usize) -> Self {
        Self { window, left: 0 }
    }

    #[inline(always)]
    fn step(&mut self, holds: bool) -> bool {
        self.left = if holds { self.window } else { self.left.saturating_sub(1) };
        self.left > 0
    }
}

/// Labels all rows, with arithmetic in `T`.
pub fn in_rows<T: Float, const CONTACTS: usize>(rows: &[Row<CONTACTS>]) -> Runs {
    let Some(first) = rows.first() else { return Runs::new() };
    let mut senses = HysteresisState { kept: 0, target: first.target, loads: 0, along: 0 };
    let (mut bridges, mut memory) = (WindowCounters::default(), TreeState::START);
    let (mut lets_go, mut rests, mut eases) =
        (LookAhead::new(RELEASE_WINDOW), LookAhead::new(PUSH_TIME), LookAhead::new(PRESS_TIME));
    // Words of rows, and words with bridged bits.
    let (mut seen, mut bridged) = ([BEHIND; RING], [0_u32; RING]);
    let (mut runs, mut bits, mut settled) = (Runs::new(), 0, false);
    for head in 0..rows.len() + ROWS_AHEAD {
        let word = rows.get(head).map_or(BEHIND, |row| senses.step::<T, CONTACTS>(row));
        seen[head % RING] = word;
        bridges.ahead(word);
        if let Some(at) = head.checked_sub(ROWS_AHEAD + 1 - PUSH_TIME) {
            rests.step(seen[at % RING] & MOVING == 0);
        }
        // Each stage lags by its look-ahead.
        let Some(at) = head.checked_sub(BRIDGE - 1) else { continue };
        let word = seen[at % RING];
        let now = bridges.step(word);
        bridged[at % RING] = word & !BRIDGED | now;
        let eases_off = eases.step(word & BEARS_DOWN == 0);
        let lets = lets_go.step(at < rows.len() && now & TOUCHES == 0);
        let Some(at) = at.checked_sub(BRIDGES_AHEAD) else { continue };
        let known = |bit: u32, is: bool| if is { bit } else { 0 };
        let ahead = known(LETS_GO, lets) | known(COMES_TO_REST, rests.left > 0) | known(EASES_OFF, eases_off);
        let new = bridged[at % RING] | ahead;
        if settled && new == bits {
            if let Some((_, frames)) = runs.last_mut() {
                *frames += 1;
            }
            continue;
        }
        let next = memory.step(new);
        settled = next == memory;
        (memory, bits) = (next, new);
        append(&mut runs, memory.label);
    }
    runs
}
