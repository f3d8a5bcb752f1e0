//! The force at which a contact begins and ends, where neither a rule nor the log names one.

/// A contact begins at this force, N.
pub const ON_N: f64 = 0.05;
/// A contact ends below this force, N.
pub const OFF_N: f64 = 0.02;
