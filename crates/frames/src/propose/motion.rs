//! Points that move, and points that move with them, in short windows of a bound log.

use nalgebra::Vector3;

/// The positions of a point, m; none in rows that lack it.
pub type Positions = [Option<Vector3<f64>>];

/// A motion for at most this time is an accident, s.
pub const LEAST_S: f64 = 0.3;
/// A point that moves by more than this in a window is moved, m.
pub const MOVED_M: f64 = 0.004;
/// An object that moves with a hand by more than this in a window is carried, m.
pub const CARRIED_M: f64 = 0.01;
/// The duration of a window, s.
pub const WINDOW_S: f64 = 0.2;
/// What moves with a point differs from its way by at most this share of it.
const SLIPS: f64 = 0.5;

/// The first row of the window that ends in each row.
pub fn windows(time: &[f64]) -> Vec<usize> {
    let mut from = 0;
    let start = |row: usize| {
        while time[row] - time[from] > WINDOW_S {
            from += 1;
        }
        from
    };
    (0..time.len()).map(start).collect()
}

/// The total duration of some rows of a log, s; 0 of an empty log.
pub fn lasts_s(rows: usize, time: &[f64]) -> f64 {
    let span = time.first().zip(time.last()).map_or(0.0, |(first, last)| last - first);
    rows as f64 * (span / time.len().max(1) as f64)
}

/// The way of a point in the window that ends in each row, m.
pub fn ways(path: &Positions, windows: &[usize]) -> Vec<Option<Vector3<f64>>> {
    path.iter().zip(windows).map(|(at, from)| Some((*at)? - path[*from]?)).collect()
}

/// Whether a point whose way is `other` moves with one whose way is `way`.
pub fn goes_with(way: &Vector3<f64>, other: &Vector3<f64>) -> bool {
    (other - way).norm() <= SLIPS * way.norm()
}
