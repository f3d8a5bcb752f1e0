//! A box of cells: an interval of each quantity, in whole steps from its nominal value.

use super::quantities::CellQuantity;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A point: the steps of each quantity from its nominal value.
pub type Point = Vec<f64>;

/// A face of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Index of the quantity.
    pub quantity: usize,
    /// Whether it is the face of the larger values.
    pub upper: bool,
}

impl Face {
    /// Returns 1 for an upper face, -1 for a lower one.
    pub fn sign(self) -> i32 {
        if self.upper { 1 } else { -1 }
    }

    /// Returns how far a point lies in the direction of the face from the nominal value, steps.
    pub fn reach(self, point: &[f64]) -> f64 {
        f64::from(self.sign()) * point[self.quantity]
    }
}

/// A box around the nominal cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellBox {
    /// The distances of the lower and the upper face of each quantity from its nominal value, steps of 0 or more.
    reach: Vec<[i32; 2]>,
}

impl CellBox {
    /// Returns the box of the nominal cell alone.
    pub fn nominal(quantities: usize) -> Self {
        Self { reach: vec![[0; 2]; quantities] }
    }

    /// Returns all faces.
    pub fn faces(&self) -> impl Iterator<Item = Face> + use<> {
        (0..self.reach.len()).flat_map(|quantity| [false, true].map(|upper| Face { quantity, upper }))
    }

    /// Returns the distance of a face from the nominal value, steps.
    pub fn reach(&self, face: Face) -> i32 {
        self.reach[face.quantity][usize::from(face.upper)]
    }

    /// Moves a face.
    pub fn set(&mut self, face: Face, reach: i32) {
        self.reach[face.quantity][usize::from(face.upper)] = reach.max(0);
    }

    /// Returns the same box with one face this far out.
    #[must_use]
    pub fn with(&self, face: Face, reach: i32) -> Self {
        let mut changed = self.clone();
        changed.set(face, reach);
        changed
    }

    /// Returns the width of a quantity's interval, steps.
    pub fn width(&self, quantity: usize) -> i32 {
        self.reach[quantity].iter().sum()
    }

    /// Whether a point is in the box or on its boundary.
    pub fn contains(&self, point: &[f64]) -> bool {
        self.faces().all(|face| face.reach(point) <= f64::from(self.reach(face)))
    }

    /// Draws a point, uniformly.
    pub fn sample(&self, rng: &mut ChaCha8Rng) -> Point {
        let between = |[below, above]: &[i32; 2], share: f64| -f64::from(*below) + f64::from(below + above) * share;
        self.reach.iter().map(|reach| between(reach, rng.random_range(0.0..=1.0))).collect()
    }

    /// Draws a point between a face and its place `steps` farther out, uniformly.
    pub fn sample_beyond(&self, face: Face, steps: i32, rng: &mut ChaCha8Rng) -> Point {
        let mut point = self.sample(rng);
        let share: f64 = rng.random_range(0.0..=1.0);
        // The face itself belongs to the box.
        let beyond = f64::from(self.reach(face)) + f64::from(steps) * (1.0 - share).max(f64::EPSILON);
        point[face.quantity] = f64::from(face.sign()) * beyond;
        point
    }

    /// Whether a point lies at most this many steps beyond this face, and inside of all other faces.
    pub fn is_beyond(&self, face: Face, steps: i32, point: &[f64]) -> bool {
        face.reach(point) > f64::from(self.reach(face)) && self.with(face, self.reach(face) + steps).contains(point)
    }
}

/// Returns the largest distance of a face that is searched, steps.
pub fn farthest(quantities: &[&CellQuantity], face: Face) -> i32 {
    let range = &quantities[face.quantity].range;
    if face.upper { *range.end() } else { -*range.start() }
}
