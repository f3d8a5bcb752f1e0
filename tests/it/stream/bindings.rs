//! A log in another frame is analyzed as it is.

use crate::program::{complained, said, teachtree_in};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::fmt::Write;
use teachtree_base::units::Dimension;
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

/// The same demonstration in a frame whose y points up, in mm, is read by the lines of docs/bindings.md, and told as it is.
#[test]
fn a_log_whose_y_points_up_is_turned_as_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let plain =
        teach(&shipped::scene("pick_and_place").unwrap(), &shipped::operator("pick_and_place").unwrap(), 1).unwrap();
    formats::write(&plain, &folder.path().join("plain.csv")).unwrap();
    // From z up to y up, of what is in the world and of the frames of bodies.
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    let (mut text, mut binding) = (String::from("time"), String::from("channels:\n"));
    let mut columns: Vec<Vec<f64>> = vec![plain.time.clone()];
    for (name, column) in &plain.columns {
        let Some((channel, part)) = name.rsplit_once('.') else { continue };
        let of = |part: &str| plain.columns.get(&format!("{channel}.{part}")).map(|column| &column.values);
        let foreign = channel.replace('.', "_");
        let (unit, scale) = if column.dimension == Dimension::LENGTH { (" [mm]", 1e3) } else { ("", 1.0) };
        let rows = 0..plain.time.len();
        match (part, of("w"), of("x"), of("y"), of("z")) {
            ("w", Some(w), Some(x), Some(y), Some(z)) => {
                let read =
                    |row: usize| UnitQuaternion::from_quaternion(Quaternion::new(w[row], x[row], y[row], z[row]));
                let seen: Vec<_> = rows.map(|row| turn * read(row) * turn.inverse()).collect();
                for (letter, value) in [
                    ("W", seen.iter().map(|it| it.w).collect()),
                    ("X", seen.iter().map(|it| it.i).collect()),
                    ("Y", seen.iter().map(|it| it.j).collect()),
                    ("Z", seen.iter().map(|it| it.k).collect::<Vec<f64>>()),
                ] {
                    let _ = write!(text, ",{foreign}_{letter}");
                    columns.push(value);
                }
                let [w, x, y, z] = ["W", "X", "Y", "Z"].map(|letter| format!("{foreign}_{letter}"));
                let _ = writeln!(binding, "  {channel}: [{w}, {x}, -{z}, {y}]");
            }
            ("x", None, Some(x), Some(y), Some(z)) => {
                let seen: Vec<_> = rows.map(|row| turn * Vector3::new(x[row], y[row], z[row]) * scale).collect();
                for (place, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
                    let _ = write!(text, ",{foreign}_{letter}");
                    columns.push(seen.iter().map(|it| it[place]).collect());
                }
                let [x, y, z] = ["X", "Y", "Z"].map(|letter| format!("{foreign}_{letter}{unit}"));
                let _ = writeln!(binding, "  {channel}: [\"{x}\", \"-{z}\", \"{y}\"]");
            }
            ("x" | "y" | "z", ..) => {}
            _ => {
                let _ = write!(text, ",{}", name.replace('.', "_"));
                columns.push(column.values.clone());
                let _ = writeln!(binding, "  {name}: {}", name.replace('.', "_"));
            }
        }
    }
    for row in 0..plain.time.len() {
        let line: Vec<String> = columns.iter().map(|column| column[row].to_string()).collect();
        let _ = write!(text, "\n{}", line.join(","));
    }
    std::fs::write(folder.path().join("up.csv"), text + "\n").unwrap();
    std::fs::write(folder.path().join("up.yaml"), binding).unwrap();
    let found = |args: &[&str]| {
        let output = teachtree_in(folder.path(), &[&["analyze"], args, &["--format", "csv"]].concat());
        assert!(output.status.success(), "{}", complained(&output));
        let table = said(&output);
        table.lines().map(|line| line.split_once(',').unwrap().1.to_string()).collect::<Vec<_>>()
    };
    let wanted = found(&["plain.csv"]);
    assert!(wanted.iter().any(|line| line.starts_with("right,task,pick_and_place")), "{wanted:?}");
    assert_eq!(found(&["up.csv", "--binding", "up.yaml", "--scene", "plain.scene.yaml"]), wanted);
}
