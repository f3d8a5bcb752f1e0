//! What people see of an analysis: a timeline for terminals, a page for browsers. Writers return text; they open no file and print nothing.

pub mod palette;
pub mod text;

/// A step of 1, 2 or 5 times a power of ten, at least as long as asked; 1 when asked for what is not a positive number.
fn round_step(at_least: f64) -> f64 {
    if !(at_least > 0.0 && at_least.is_finite()) {
        return 1.0;
    }
    let power = 10.0_f64.powf(at_least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|factor| factor * power).find(|step| *step >= at_least).unwrap_or(10.0 * power)
}
