//! Recordings for the job: consecutive phases of handling an object, 1 kHz, with noise, and contacts that chatter when they are made and lost.

use std::f64::consts::TAU;

/// Channels of a frame: the object's position (0..3), rotation w x y z (3..7), velocity (7..10) and angular velocity (10..13); position and force
/// of fingertip i (13 + 6 i ..); whether the object touches the floor (43) and a wall (44). SI.
pub const CHANNELS: usize = 45;

/// The phases of the operator, and their successors.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    Idle,
    Approach,
    Grasp,
    Lift,
    Hold,
    Turn,
    Slip,
    Lower,
    Place,
    Release,
    Push,
    Wallslide,
    Pivot,
    Drop,
    Roll,
}

use Phase::*;

impl Phase {
    fn next(self) -> &'static [Phase] {
        match self {
            Idle => &[Approach],
            Approach => &[Grasp, Grasp, Push, Wallslide, Idle],
            Grasp => &[Lift, Lift, Push, Pivot],
            Lift => &[Hold],
            Hold => &[Lower, Turn, Slip, Lower, Drop],
            Turn => &[Hold, Lower],
            Slip => &[Hold, Lower, Drop],
            Lower => &[Place],
            Place => &[Release],
            Release => &[Idle, Approach],
            Push => &[Release, Wallslide, Grasp, Roll],
            Wallslide => &[Pivot, Release],
            Pivot => &[Grasp, Roll, Release],
            Drop => &[Idle],
            Roll => &[Idle, Grasp],
        }
    }

    fn touches(self) -> bool {
        !matches!(self, Idle | Approach | Release | Drop | Roll)
    }

    fn in_air(self) -> bool {
        matches!(self, Lift | Hold | Turn | Slip | Lower | Drop)
    }

    fn at_wall(self) -> bool {
        matches!(self, Wallslide | Pivot)
    }

    /// Distance of the fingertips from the object's center at the end of the phase, m.
    fn reach(self) -> f64 {
        match self {
            Approach => 0.085,
            Release => 0.083,
            Idle | Drop => 0.15,
            Roll => 0.16,
            _ => 0.078,
        }
    }
}

/// SplitMix64, with the distributions drawn from it.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    fn noise(&mut self, sigma: f64) -> f64 {
        // The sum of four uniform numbers approximates a normal distribution well enough.
        let sum: f64 = (0..4).map(|_| self.share()).sum();
        (sum - 2.0) * 3_f64.sqrt() * sigma
    }

    /// A flag that changes to `on`, with bursts of 3 to 12 ms for 40 ms after a change.
    fn flag(&mut self, on: bool, before: bool, len: usize) -> Vec<f64> {
        let mut flag = vec![f64::from(u8::from(on)); len];
        let mut at = 0;
        while on != before && at < len.min(40) {
            let burst = 3 + (self.next() % 10) as usize;
            let value = f64::from(u8::from(self.share() < 0.5));
            let end = (at + burst).min(len).min(40);
            flag[at..end].fill(value);
            at += burst;
        }
        flag
    }
}

/// Returns `frames` frames, as rows.
pub fn rows(frames: usize, seed: u64) -> Vec<[f32; CHANNELS]> {
    let mut chance = SplitMix64(seed);
    let directions = [[0.0, 1.0, 0.2], [0.35, -0.9, 0.3], [0.1, -1.0, 0.0], [-0.35, -0.9, -0.3], [-0.6, -0.7, -0.5]]
        .map(|[x, y, z]: [f64; 3]| [x, y, z].map(|part| part / (x * x + y * y + z * z).sqrt()));
    let mut rows = Vec::with_capacity(frames);
    let (mut phase, mut position, mut yaw, mut reach, mut sign) = (Idle, [0.0, 0.0, 0.06], 0.0_f64, 0.14, 1.0);
    let (mut touched, mut on_floor, mut at_wall) = (false, true, false);
    while rows.len() < frames {
        let time = if phase == Drop { chance.between(0.2, 0.35) } else { chance.between(0.2, 2.0) };
        let len = ((time * 1000.0) as usize).min(frames - rows.len()).max(1);
        let speed = match phase {
            Lift => chance.between(0.04, 0.15),
            Slip => -chance.between(0.02, 0.05),
            Lower | Drop => -(position[2] - 0.06_f64).max(0.01) * 1.2 / time,
            Push => sign * chance.between(0.04, 0.2),
            Wallslide => sign * chance.between(0.03, 0.1),
            Pivot => 0.03,
            Roll => sign * 0.08,
            _ => 0.0,
        };
        let spin = match phase {
            Turn => sign * chance.between(0.6, 2.0),
            Pivot => chance.between(0.5, 1.5),
            Roll => sign * 1.2,
            _ => 0.0,
        };
        let (pull, grip, fingers): ([f64; 3], f64, usize) = match phase {
            Lift | Hold | Lower => ([0.0, 0.0, 0.8], 1.5, 5),
            Turn => ([0.0, 0.0, 0.8], 1.2, 5),
            Slip => ([0.0, 0.0, 0.6], 0.5, 5),
            Push => ([sign * chance.between(0.7, 1.5), 0.0, -0.2], 0.4, 2 + (chance.next() % 3) as usize),
            Wallslide => ([0.9, sign * 0.4, 0.0], 0.5, 3),
            Pivot => ([0.8, 0.0, 0.3], 0.6, 2),
            Grasp => ([0.1, 0.0, 0.0], 1.0, 5),
            Place => ([0.0, 0.0, 0.2], 0.4, 5),
            _ => ([0.0; 3], 0.0, 0),
        };
        let sliding = if phase == Slip { chance.between(0.1, 0.25) } else { 0.0 };
        let axis = match phase {
            Push | Pivot | Roll => 0,
            Wallslide => 1,
            _ => 2,
        };
        let touch = chance.flag(phase.touches(), touched, len);
        let floor = chance.flag(!phase.in_air(), on_floor, len);
        let wall = chance.flag(phase.at_wall(), at_wall, len);
        (touched, on_floor, at_wall) = (phase.touches(), !phase.in_air(), phase.at_wall());
        let from = reach;
        for at in 0..len {
            let share = (at as f64 + 0.5) / len as f64;
            let ramp = (6.0 * share.min(1.0 - share)).min(1.0);
            let mut velocity = [0.0; 3];
            velocity[axis] = speed * if phase == Drop { 2.0 * share } else { ramp };
            let mut turning = [0.0; 3];
            turning[if phase == Turn { 2 } else { 1 }] = spin * ramp;
            for (position, velocity) in position.iter_mut().zip(velocity) {
                *position += velocity / 1000.0;
            }
            yaw = (yaw + turning[2] / 1000.0) % TAU;
            reach = from + (phase.reach() - from) * (share * len as f64 / 120.0).min(1.0);
            let mut row = [0.0; CHANNELS];
            row[..3].copy_from_slice(&position);
            (row[3], row[6]) = ((yaw / 2.0).cos(), (yaw / 2.0).sin());
            for part in 0..3 {
                row[7 + part] = velocity[part] + chance.noise(0.0012);
                row[10 + part] = turning[part] + chance.noise(0.02);
            }
            for (finger, direction) in directions.iter().enumerate() {
                let base = 13 + 6 * finger;
                let presses = finger < fingers;
                let amount = touch[at] * (1.0 + 0.1 * (TAU * 3.0 * share * time).sin());
                for part in 0..3 {
                    let lag = if part == 2 { sliding * at as f64 / 1000.0 } else { 0.0 };
                    row[base + part] = position[part] + direction[part] * reach + lag + chance.noise(2e-6);
                    let force = if presses { -direction[part] * grip + pull[part] / fingers as f64 } else { 0.0 };
                    row[base + 3 + part] = force * amount + chance.noise(0.015);
                }
            }
            (row[43], row[44]) = (floor[at], wall[at]);
            rows.push(row.map(|value| value as f32));
        }
        if matches!(phase, Lower | Drop) {
            position[2] = 0.06;
        }
        if chance.share() < 0.5 {
            sign = -sign;
        }
        if position[0].abs() > 2.0 {
            position[0] = 0.0;
        }
        let choices = phase.next();
        phase = choices[(chance.next() % choices.len() as u64) as usize];
    }
    rows
}

/// Converts rows to columns.
pub fn columns<T: From<f32>>(rows: &[[f32; CHANNELS]]) -> Vec<Vec<T>> {
    (0..CHANNELS).map(|channel| rows.iter().map(|row| row[channel].into()).collect()).collect()
}
