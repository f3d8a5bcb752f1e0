//! Transforms of a recording: slower, at another rate, rotated, backward, with fewer sensors. Columns are classified by their dimension and
//! their components, not by a list of names.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_base::units::Dimension;

/// Stretches time by `factor`: speeds are divided by it, forces are unchanged.
pub fn slowed(mut recording: Recording, factor: f64) -> Recording {
    recording.time.iter_mut().for_each(|time| *time *= factor);
    recording.events.iter_mut().for_each(|event| event.time_s *= factor);
    speeds(&mut recording, |speed| speed / factor);
    recording
}

/// Reverses time: a contact that was made is lost.
pub fn reversed(mut recording: Recording) -> Recording {
    let ends_s =
        recording.time.first().copied().unwrap_or_default() + recording.time.last().copied().unwrap_or_default();
    recording.time = recording.time.iter().rev().map(|time| ends_s - time).collect();
    recording.columns.values_mut().for_each(|column| column.values.reverse());
    recording.labels.values_mut().for_each(|texts| texts.reverse());
    recording.events.reverse();
    for event in &mut recording.events {
        event.time_s = ends_s - event.time_s;
        event.kind = match event.kind.as_str() {
            "contact_made" => "contact_lost".into(),
            "contact_lost" => "contact_made".into(),
            _ => continue,
        };
    }
    speeds(&mut recording, |speed| -speed);
    recording
}

/// Resamples to `rate_hz`: each new row is the nearest old one, labels and flags included.
pub fn resampled(mut recording: Recording, rate_hz: f64) -> Recording {
    let time = std::mem::take(&mut recording.time);
    let (Some(&start_s), Some(&end_s)) = (time.first(), time.last()) else { return recording };
    // A row at the very end is kept in spite of rounding.
    let count = ((end_s - start_s) * rate_hz + 1e-6) as usize + 1;
    recording.time = (0..count).map(|row| start_s + row as f64 / rate_hz).collect();
    let nearest = |at: f64| {
        let after = time.partition_point(|old| *old < at).min(time.len() - 1);
        if after > 0 && at - time[after - 1] < time[after] - at { after - 1 } else { after }
    };
    let rows: Vec<usize> = recording.time.iter().map(|at| nearest(*at)).collect();
    for column in recording.columns.values_mut() {
        column.values = rows.iter().map(|row| column.values[*row]).collect();
    }
    for texts in recording.labels.values_mut() {
        *texts = rows.iter().map(|row| texts[*row].clone()).collect();
    }
    recording
}

/// Rotates all vectors, and the bodies of the scene, about the vertical axis of the reference frame; angle in rad.
pub fn turned(mut recording: Recording, angle: f64) -> Recording {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let of_x = |name: &String| name.strip_suffix(".x").map(str::to_string);
    let names: Vec<String> = recording.columns.keys().filter_map(of_x).collect();
    for name in names {
        let rotation = recording.columns.contains_key(&format!("{name}.w"));
        let parts = if rotation { &["w", "x", "y", "z"][..] } else { &["x", "y", "z"] };
        let mut columns: Vec<Vec<f64>> = parts.iter().filter_map(|part| take(&mut recording, &name, part)).collect();
        for row in 0..recording.time.len() {
            match columns.as_mut_slice() {
                [x, y, z] => {
                    let vector = turn * Vector3::new(x[row], y[row], z[row]);
                    (x[row], y[row], z[row]) = (vector.x, vector.y, vector.z);
                }
                [w, x, y, z] => {
                    let [wt, xt, yt, zt] = turned_rotation(&turn, [w[row], x[row], y[row], z[row]]);
                    (w[row], x[row], y[row], z[row]) = (wt, xt, yt, zt);
                }
                // A channel with fewer components is not a vector of the reference frame.
                _ => {}
            }
        }
        for (part, values) in parts.iter().zip(columns) {
            if let Some(column) = recording.columns.get_mut(&format!("{name}.{part}")) {
                column.values = values;
            }
        }
    }
    for body in recording.scene.bodies.values_mut() {
        let position = turn * Vector3::from(body.position.map(|length| length.0));
        body.position = [position.x, position.y, position.z].map(Quantity);
        body.rotation = turned_rotation(&turn, body.rotation);
    }
    recording
}

/// Removes the contact flags of the fingertips.
pub fn without_flags(mut recording: Recording) -> Recording {
    recording.columns.retain(|name, _| !(name.ends_with(".contact") && name.split('.').count() == 3));
    recording
}

/// Removes the forces between bodies.
pub fn without_contacts(mut recording: Recording) -> Recording {
    recording.columns.retain(|name, _| !name.starts_with("contact."));
    recording
}

fn take(recording: &mut Recording, name: &str, part: &str) -> Option<Vec<f64>> {
    recording.columns.get_mut(&format!("{name}.{part}")).map(|column| std::mem::take(&mut column.values))
}

fn turned_rotation(turn: &UnitQuaternion<f64>, [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    let rotation = turn.into_inner() * Quaternion::new(w, x, y, z);
    [rotation.w, rotation.i, rotation.j, rotation.k]
}

fn speeds(recording: &mut Recording, change: impl Fn(f64) -> f64) {
    for column in recording.columns.values_mut() {
        if [Dimension::SPEED, Dimension::ANGULAR_SPEED].contains(&column.dimension) {
            column.values.iter_mut().for_each(|speed| *speed = change(*speed));
        }
    }
}
