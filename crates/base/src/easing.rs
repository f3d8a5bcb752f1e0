//! Easing: how a motion from rest to rest goes with the share of its time, both from 0 to 1.

/// Returns the way of minimum jerk, 10 t³ - 15 t⁴ + 6 t⁵: velocity and acceleration are zero at both ends (T. Flash and N. Hogan, *The Coordination of Arm
/// Movements*, 1985).
pub fn minimum_jerk(share: f64) -> f64 {
    let t = share.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

/// Returns the cubic 3 t² - 2 t³: the velocity is zero at both ends.
pub fn smooth_step(share: f64) -> f64 {
    let t = share.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
