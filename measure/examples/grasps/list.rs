//! The list of grasps in `tests/fixtures/grasps.json`: its types, reading and writing.

use nalgebra::{Point3, Vector3};
use serde_json::Value;
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;
use teachtree_base::yaml;
use teachtree_robot::grasp::Contact;

/// The path of the list.
pub const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/fixtures/grasps.json");

/// The grasps.
pub fn listed() -> Vec<Value> {
    let text = std::fs::read_to_string(FILE).expect("generate the list first");
    serde_json::from_str(&text).expect("the list is JSON")
}

/// The object of a grasp and its contacts.
pub fn read(grasp: &Value) -> (Body, Vec<Contact>) {
    let contacts = grasp["contacts"].as_array().expect("a list").iter().map(|contact| {
        let (point, normal) = (numbers(&contact["point"]), numbers(&contact["normal"]));
        Contact {
            finger: Finger::from_name(contact["finger"].as_str().expect("a name")).expect("a finger"),
            point: Point3::from_slice(&point),
            normal: Vector3::from_column_slice(&normal),
        }
    });
    (body(grasp["shape"].as_str().expect("a shape")), contacts.collect())
}

/// Creates an object from a shape in the notation of scenes.
pub fn body(shape: &str) -> Body {
    yaml::read(&format!("{{role: object, mass: 50 g, parts: [{{{shape}}}]}}"), "shape").expect("it was written here")
}

/// Numbers in a list.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("a number")).collect()
}
