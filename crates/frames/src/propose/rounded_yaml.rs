//! Numbers, points and shapes as texts of YAML, rounded.

/// Numbers with four digits.
pub fn numbers<const COUNT: usize>(vector: [f64; COUNT]) -> String {
    vector.map(|part| (plain(part * 1e4) / 1e4).to_string()).join(", ")
}

/// A point in mm.
pub fn point_mm(point: [f64; 3]) -> String {
    let parts = point.map(|part| format!("{} mm", plain(part * 1e3)));
    format!("[{}]", parts.join(", "))
}

/// A whole number; zero has no sign.
pub fn plain(value: f64) -> f64 {
    value.round() + 0.0
}

/// A box with these edges, m.
pub fn boxed(edges_m: [f64; 3]) -> String {
    format!("{{box: {}}}", edges(edges_m))
}

/// Lengths with units.
pub fn edges(lengths_m: [f64; 3]) -> String {
    let length = |length_m: f64| {
        let length_mm = plain(length_m * 1e3);
        if length_mm < 1e3 { format!("{length_mm} mm") } else { format!("{} m", length_mm / 1e3) }
    };
    format!("[{}]", lengths_m.map(length).join(", "))
}
