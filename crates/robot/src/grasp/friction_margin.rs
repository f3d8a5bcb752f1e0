//! The friction that contacts need to hold an object: force closure with uncertain friction.
//!
//! Contacts hold if forces within their friction cones are in balance (Murray, Li and Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994,
//! section 5.3; contacts are points with friction). The smallest coefficient of friction for which such forces exist is found by bisection. For each
//! coefficient, the forces in balance and those within the cones are two convex sets; the method of Douglas and Rachford (P.-L. Lions and B. Mercier, *Splitting
//! Algorithms for the Sum of Two Nonlinear Operators*, SIAM Journal on Numerical Analysis 16, 1979) finds a point of both. Of two contacts it is the larger tangent of the angles
//! between their line and the normals.

use super::grasp_request::Contact;
use nalgebra::{DMatrix, DVector, Vector3};
use teachtree_command::FRICTION;

/// Contacts that need more friction than this do not hold.
const MOST: f64 = 2.0 * FRICTION;
/// Number of bisections: the result is at most `MOST` / 2⁹ too large.
const BISECTIONS: usize = 9;
/// Number of iterations for one coefficient.
const ITERATIONS: usize = 200;
/// Forces whose normal parts add up to 1 are in balance if the nearest balance is closer than this, divided by the number of contacts.
const BALANCED: f64 = 2e-3;
/// Relative size below which a singular value is zero.
const SINGULAR: f64 = 1e-9;

/// Returns the share by which the friction of fingertips may be smaller than assumed until contacts no longer hold the object: 1 − μ/μ₀ with the coefficient μ that
/// they need, and the assumed one μ₀; 0 where they need more than that.
pub fn friction_margin(contacts: &[Contact]) -> f64 {
    friction_needed(contacts).map_or(0.0, |needed| (1.0 - needed / FRICTION).max(0.0))
}

/// Returns the smallest coefficient of friction with which contacts hold the object; `None` if it exceeds [`MOST`], as for contacts on one side, or if there are
/// none.
pub fn friction_needed(contacts: &[Contact]) -> Option<f64> {
    let balance = Balance::new(contacts)?;
    let mut forces = balance.within(MOST, &balance.some)?;
    let (mut low, mut high) = (0.0, MOST);
    for _ in 0..BISECTIONS {
        let middle = (low + high) / 2.0;
        match balance.within(middle, &forces) {
            Some(found) => (high, forces) = (middle, found),
            None => low = middle,
        }
    }
    Some(high)
}

/// Forces of contacts that are in balance: their sum and their moment are zero, and the sum of their normal parts is 1.
struct Balance {
    normals: Vec<Vector3<f64>>,
    /// Forces in balance; and the projection onto the differences of such forces.
    some: DVector<f64>,
    free: DMatrix<f64>,
}

impl Balance {
    fn new(contacts: &[Contact]) -> Option<Self> {
        let count = contacts.len();
        let finite =
            |contact: &Contact| contact.point.coords.iter().chain(&contact.normal).all(|number| number.is_finite());
        if count == 0 || !contacts.iter().all(finite) {
            return None;
        }
        let middle = contacts.iter().map(|contact| contact.point.coords).sum::<Vector3<f64>>() / count as f64;
        let arms: Vec<Vector3<f64>> = contacts.iter().map(|contact| contact.point.coords - middle).collect();
        // Moments count as forces at the mean distance of the contacts from their center.
        let scale = (arms.iter().map(|arm| arm.norm()).sum::<f64>() / count as f64).max(1e-9);
        let mut wrenches = DMatrix::zeros(7, 3 * count);
        for (at, (contact, arm)) in contacts.iter().zip(&arms).enumerate() {
            wrenches.fixed_view_mut::<3, 3>(0, 3 * at).fill_with_identity();
            wrenches.fixed_view_mut::<3, 3>(3, 3 * at).copy_from(&(arm / scale).cross_matrix());
            wrenches.fixed_view_mut::<1, 3>(6, 3 * at).copy_from(&(-contact.normal).transpose());
        }
        let mut wanted = DVector::zeros(7);
        wanted[6] = 1.0;
        let inverse = wrenches.clone().pseudo_inverse(SINGULAR).ok()?;
        let some = &inverse * &wanted;
        if (&wrenches * &some - wanted).norm() > 1e-6 {
            return None;
        }
        let free = DMatrix::identity(3 * count, 3 * count) - inverse * wrenches;
        Some(Self { normals: contacts.iter().map(|contact| contact.normal).collect(), some, free })
    }

    /// Returns forces in balance within the friction cones, and begins the search at others; `None` if none are found.
    fn within(&self, friction: f64, begin: &DVector<f64>) -> Option<DVector<f64>> {
        let balanced = |forces: &DVector<f64>| &self.free * forces + &self.some;
        let mut at = begin.clone();
        for _ in 0..ITERATIONS {
            let mut inside = at.clone();
            for (index, normal) in self.normals.iter().enumerate() {
                let mut force = inside.fixed_rows_mut::<3>(3 * index);
                let nearest = nearest_in_cone(&force.clone_owned(), normal, friction);
                force.copy_from(&nearest);
            }
            if (balanced(&inside) - &inside).norm() < BALANCED / self.normals.len() as f64 {
                return Some(at);
            }
            let reflected = &inside * 2.0 - &at;
            at += balanced(&reflected) - inside;
        }
        None
    }
}

/// Returns the force on the object nearest to this one within the friction cone about `-normal`.
fn nearest_in_cone(force: &Vector3<f64>, normal: &Vector3<f64>, friction: f64) -> Vector3<f64> {
    let pressed = -force.dot(normal);
    let along = force + normal * pressed;
    let length = along.norm();
    if length <= friction * pressed {
        return *force;
    }
    if friction * length <= -pressed {
        return Vector3::zeros();
    }
    let pressed = (pressed + friction * length) / (1.0 + friction * friction);
    along * (friction * pressed / length) - normal * pressed
}
