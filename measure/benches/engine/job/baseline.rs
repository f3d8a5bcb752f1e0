//! The job written by hand: a fused loop over rows, and blocks of columns as an expert would write them. Labels are positions in [`LABELS`].

use super::data::CHANNELS;
use std::ops::{Add, Mul, Sub};

/// The primitives, in the order of `job.rules`.
pub const LABELS: [&str; 14] = [
    "Idle",
    "Approach",
    "Grasp",
    "Lift",
    "Hold",
    "Lower",
    "Push",
    "Pivot",
    "Wallslide",
    "Release",
    "Slip",
    "Drop",
    "Roll",
    "Inhand",
];
const IDLE: u8 = 0;
const APPROACH: u8 = 1;
const GRASP: u8 = 2;
const LIFT: u8 = 3;
const HOLD: u8 = 4;
const LOWER: u8 = 5;
const PUSH: u8 = 6;
const PIVOT: u8 = 7;
const WALLSLIDE: u8 = 8;
const RELEASE: u8 = 9;
const SLIP: u8 = 10;
const DROP: u8 = 11;
const ROLL: u8 = 12;
const INHAND: u8 = 13;

// Bits of the twelve predicates.
const FORCED: u32 = 1;
const TOUCHING: u32 = 1 << 1;
const FLOOR: u32 = 1 << 2;
const WALL: u32 = 1 << 3;
const MOVING: u32 = 1 << 4;
const TURNING: u32 = 1 << 5;
const UP: u32 = 1 << 6;
const DOWN: u32 = 1 << 7;
const NEAR: u32 = 1 << 8;
const SEVERAL: u32 = 1 << 9;
const PUSHED: u32 = 1 << 10;
const SLIPPING: u32 = 1 << 11;

/// Frames that a predicate must differ before it changes (debounce).
const DEBOUNCE: u8 = 20;

/// The arithmetic types f32 and f64.
pub trait Float:
    Copy + Default + PartialOrd + From<f32> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// Converts a constant.
    fn of(constant: f64) -> Self;
    /// The square root.
    fn root(self) -> Self;
}

impl Float for f32 {
    #[inline(always)]
    fn of(constant: f64) -> Self {
        constant as f32
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}

impl Float for f64 {
    #[inline(always)]
    fn of(constant: f64) -> Self {
        constant
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}

/// Returns the square of a norm.
#[inline(always)]
pub fn square<T: Float>(x: T, y: T, z: T) -> T {
    x * x + y * y + z * z
}

/// Debounces the predicates of one word.
#[derive(Default)]
struct Debouncer {
    bits: u32,
    counts: [u8; 12],
}

impl Debouncer {
    #[inline(always)]
    fn step(&mut self, raw: u32) -> u32 {
        let differs = raw ^ self.bits;
        if differs == 0 {
            self.counts = [0; 12];
            return self.bits;
        }
        for (at, count) in self.counts.iter_mut().enumerate() {
            *count = if differs >> at & 1 != 0 { *count + 1 } else { 0 };
            if *count >= DEBOUNCE {
                self.bits ^= 1 << at;
                *count = 0;
            }
        }
        self.bits
    }
}

#[inline(always)]
fn label(bits: u32, before: u8) -> u8 {
    let is = |bit: u32| bits & bit != 0;
    if !is(TOUCHING) {
        return match () {
            () if is(MOVING) && is(FLOOR) => {
                if !is(TURNING) && before == PUSH {
                    PUSH
                } else {
                    ROLL
                }
            }
            () if is(MOVING) => {
                if is(DOWN) || before == DROP {
                    DROP
                } else {
                    IDLE
                }
            }
            () if !is(NEAR) => IDLE,
            () => {
                if matches!(before, GRASP | HOLD | LOWER | PUSH | PIVOT | RELEASE) {
                    RELEASE
                } else {
                    APPROACH
                }
            }
        };
    }
    if is(FLOOR) {
        return match () {
            () if is(MOVING) && is(WALL) => {
                if is(TURNING) || before == PIVOT {
                    PIVOT
                } else {
                    WALLSLIDE
                }
            }
            () if is(MOVING) && is(TURNING) => {
                if before == PIVOT {
                    PIVOT
                } else {
                    ROLL
                }
            }
            () if is(MOVING) => {
                if !is(PUSHED) && before == LOWER {
                    LOWER
                } else {
                    PUSH
                }
            }
            () if is(FORCED) && is(PUSHED) => GRASP,
            () => {
                if matches!(before, LOWER | RELEASE) {
                    RELEASE
                } else {
                    GRASP
                }
            }
        };
    }
    match () {
        () if is(SLIPPING) => SLIP,
        () if is(TURNING) => {
            if is(SEVERAL) {
                INHAND
            } else {
                PIVOT
            }
        }
        () if is(UP) => LIFT,
        () if is(DOWN) => LOWER,
        () if is(WALL) => WALLSLIDE,
        () if is(FORCED) => HOLD,
        () => {
            if matches!(before, HOLD | INHAND) {
                before
            } else {
                LIFT
            }
        }
    }
}

/// The state of the row loop, which fits into registers.
pub struct RowLoop<T> {
    hysteresis: u32,
    debounced: Debouncer,
    before: u8,
    tips: Option<[T; 15]>,
}

impl<T: Float> RowLoop<T> {
    /// The state before the first frame.
    pub fn new() -> Self {
        Self { hysteresis: 0, debounced: Debouncer::default(), before: IDLE, tips: None }
    }

    /// Returns the label of a frame.
    #[inline(always)]
    pub fn step(&mut self, row: &[T; CHANNELS]) -> u8 {
        let raw = self.raw(row);
        self.hysteresis = raw;
        let tips = self.tips.get_or_insert([T::default(); 15]);
        for finger in 0..5 {
            tips[3 * finger..][..3].copy_from_slice(&row[13 + 6 * finger..][..3]);
        }
        self.before = label(self.debounced.step(raw), self.before);
        self.before
    }

    #[inline(always)]
    fn raw(&self, row: &[T; CHANNELS]) -> u32 {
        let zero = T::of(0.0);
        let (mut fx, mut fy, mut fz) = (zero, zero, zero);
        let (mut touched, mut near, mut slips) = (0_u32, false, false);
        for finger in 0..5 {
            let base = 13 + 6 * finger;
            let [x, y, z, u, v, w] =
                [row[base], row[base + 1], row[base + 2], row[base + 3], row[base + 4], row[base + 5]];
            (fx, fy, fz) = (fx + u, fy + v, fz + w);
            let touches = square(u, v, w) > T::of(0.1 * 0.1);
            touched += u32::from(touches);
            near |= square(x - row[0], y - row[1], z - row[2]) < T::of(0.09 * 0.09);
            if let Some(tips) = self.tips.as_ref().filter(|_| touches) {
                let rate = T::of(1000.0);
                let speed = square(
                    (x - tips[3 * finger]) * rate - row[7],
                    (y - tips[3 * finger + 1]) * rate - row[8],
                    (z - tips[3 * finger + 2]) * rate - row[9],
                );
                slips |= speed > T::of(0.05 * 0.05);
            }
        }
        let bit = |bit: u32, on: bool| if on { bit } else { 0 };
        let held = |bit: u32, value: T, on: f64, off: f64| {
            let threshold = if self.hysteresis & bit != 0 { T::of(off * off) } else { T::of(on * on) };
            if value > threshold { bit } else { 0 }
        };
        held(FORCED, square(fx, fy, fz), 0.5, 0.3)
            | bit(TOUCHING, touched >= 1)
            | bit(FLOOR, row[43] > T::of(0.5))
            | bit(WALL, row[44] > T::of(0.5))
            | held(MOVING, square(row[7], row[8], row[9]), 0.02, 0.01)
            | held(TURNING, square(row[10], row[11], row[12]), 0.3, 0.15)
            | bit(UP, row[9] > T::of(0.015))
            | bit(DOWN, row[9] < T::of(-0.015))
            | bit(NEAR, near)
            | bit(SEVERAL, touched >= 3)
            | held(PUSHED, fx * fx + fy * fy, 0.4, 0.3)
            | bit(SLIPPING, slips)
    }
}

/// Runs of equal labels, with their lengths.
pub type Runs = Vec<(u8, usize)>;

/// Appends one frame.
pub fn append(runs: &mut Runs, label: u8) {
    match runs.last_mut() {
        Some((last, frames)) if *last == label => *frames += 1,
        _ => runs.push((label, 1)),
    }
}

/// Labels all rows.
pub fn in_rows<T: Float>(rows: &[[T; CHANNELS]]) -> Runs {
    let mut row_loop = RowLoop::new();
    let mut runs = Vec::new();
    for row in rows {
        append(&mut runs, row_loop.step(row));
    }
    runs
}

const BLOCK: usize = 512;

/// Labels columns, one block at a time: stateless predicates as words of bits, then only the frames on which a predicate changes.
pub fn in_blocks<T: Float>(columns: &[Vec<T>]) -> Runs {
    let frames = columns[0].len();
    let (mut debounced, mut before, mut held, mut calm) = (Debouncer::default(), IDLE, 0_u32, false);
    let mut runs: Runs = Vec::new();
    let (mut on, mut off) = ([0_u32; BLOCK], [0_u32; BLOCK]);
    let zero = T::of(0.0);
    for start in (0..frames).step_by(BLOCK) {
        let len = BLOCK.min(frames - start);
        let column = |channel: usize| &columns[channel][start..start + len];
        // The previous frame; the first frame is its own predecessor.
        let earlier =
            |channel: usize| if start == 0 { None } else { Some(&columns[channel][start - 1..start - 1 + len]) };
        let (mut fx, mut fy, mut fz) = ([zero; BLOCK], [zero; BLOCK], [zero; BLOCK]);
        let (mut count, mut flags) = ([0_u32; BLOCK], [0_u32; BLOCK]);
        let [px, py, pz] = [column(0), column(1), column(2)];
        let [vx, vy, vz] = [column(7), column(8), column(9)];
        for finger in 0..5 {
            let base = 13 + 6 * finger;
            let [x, y, z, u, v, w] = [0, 1, 2, 3, 4, 5].map(|part| column(base + part));
            let mut lead = [[zero; BLOCK]; 3];
            let last: [&[T]; 3] = match [0, 1, 2].map(|part| earlier(base + part)) {
                [Some(x), Some(y), Some(z)] => [x, y, z],
                _ => {
                    for (lead, tip) in lead.iter_mut().zip([x, y, z]) {
                        lead[0] = tip[0];
                        lead[1..len].copy_from_slice(&tip[..len - 1]);
                    }
                    [&lead[0][..len], &lead[1][..len], &lead[2][..len]]
                }
            };
            let rate = T::of(1000.0);
            for at in 0..len {
                (fx[at], fy[at], fz[at]) = (fx[at] + u[at], fy[at] + v[at], fz[at] + w[at]);
                let touches = u32::from(square(u[at], v[at], w[at]) > T::of(0.1 * 0.1));
                let near = u32::from(square(x[at] - px[at], y[at] - py[at], z[at] - pz[at]) < T::of(0.09 * 0.09));
                let speed = square(
                    (x[at] - last[0][at]) * rate - vx[at],
                    (y[at] - last[1][at]) * rate - vy[at],
                    (z[at] - last[2][at]) * rate - vz[at],
                );
                count[at] += touches;
                flags[at] |= near << 8 | (touches & u32::from(speed > T::of(0.05 * 0.05))) << 11;
            }
        }
        let [wx, wy, wz, floor, wall] = [column(10), column(11), column(12), column(43), column(44)];
        for at in 0..len {
            let bit = |shift: u32, is: bool| u32::from(is) << shift;
            let flat = fx[at] * fx[at] + fy[at] * fy[at];
            let force = flat + fz[at] * fz[at];
            let (speed, turn) = (square(vx[at], vy[at], vz[at]), square(wx[at], wy[at], wz[at]));
            let over = |value: T, threshold: f64| value > T::of(threshold * threshold);
            on[at] = flags[at]
                | bit(0, over(force, 0.5))
                | bit(1, count[at] >= 1)
                | bit(2, floor[at] > T::of(0.5))
                | bit(3, wall[at] > T::of(0.5))
                | bit(4, over(speed, 0.02))
                | bit(5, over(turn, 0.3))
                | bit(6, vz[at] > T::of(0.015))
                | bit(7, vz[at] < T::of(-0.015))
                | bit(9, count[at] >= 3)
                | bit(10, over(flat, 0.4));
            off[at] = bit(0, over(force, 0.3))
                | bit(4, over(speed, 0.01))
                | bit(5, over(turn, 0.15))
                | bit(10, over(flat, 0.3));
        }
        if start == 0 {
            on[0] &= !SLIPPING;
        }
        let mut since = 0;
        for at in 0..len {
            held = on[at] | held & off[at];
            if calm && held == debounced.bits {
                continue;
            }
            if let (Some((_, frames)), true) = (runs.last_mut(), at > since) {
                *frames += at - since;
            }
            since = at + 1;
            let bits = debounced.step(held);
            let now = label(bits, before);
            calm = bits == held && now == before;
            before = now;
            append(&mut runs, now);
        }
        if let (Some((_, frames)), true) = (runs.last_mut(), len > since) {
            *frames += len - since;
        }
    }
    runs
}
