//! The joints in the recording of a robot.

use super::kinematics::shipped;
use super::motion::lift;
use nalgebra::{Point3, Vector3};
use teachtree_base::hands::Side;
use teachtree_robot::simulation::{Performance, simulate};

/// The recorded joint positions put the palm where the recording has it, their differences are the recorded rates, and at rest the motors of the arm hold its
/// weight and that of the cube: the torque of a joint is its axis times the moment of all masses that it carries.
#[test]
fn recorded_joints_agree_with_the_recorded_palm_and_hold_the_weight() {
    let robot = shipped("both_hands");
    let (mut commands, scene) = lift(2.0, 1.0);
    teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    let Performance { recording, .. } = simulate(&commands, &robot, &scene, &mut |_| ()).unwrap();
    let tree = &robot.limb(Side::Right).unwrap().tree;
    let values = |name: &str| &recording.columns[name].values;
    let joints = |part: &str| tree.dofs.iter().map(|dof| values(&format!("right.joint.{}.{part}", dof.name))).collect();
    let [positions, rates, efforts]: [Vec<&Vec<f64>>; 3] = ["position", "velocity", "effort"].map(joints);
    let vector =
        |name: &str, row: usize| Vector3::from(["x", "y", "z"].map(|axis| values(&format!("{name}.{axis}"))[row]));
    let palm = tree.links.iter().position(|link| link.name.ends_with("palm")).unwrap();
    for row in (1..recording.time.len() - 1).step_by(100) {
        let q: Vec<f64> = positions.iter().map(|values| values[row]).collect();
        let found = tree.forward_kinematics(&q)[palm].translation.vector;
        let expected = vector("right.palm.position", row);
        // The palm is recorded before the last step of the joints, 1 ms.
        let step = (vector("right.palm.position", row + 1) - vector("right.palm.position", row - 1)).norm() / 8.0;
        assert!((found - expected).norm() < 1e-5 + 1.5 * step, "row {row}: {found} m, expected {expected} m");
        for (position, rate) in positions.iter().zip(&rates) {
            let difference =
                (position[row + 1] - position[row - 1]) / (recording.time[row + 1] - recording.time[row - 1]);
            assert!(
                (difference - rate[row]).abs() < 0.05 + 0.05 * rate[row].abs(),
                "row {row}: {difference}, {rate:?}"
            );
        }
    }
    let row = recording.time.len() - 2;
    let q: Vec<f64> = positions.iter().map(|values| values[row]).collect();
    let poses = tree.forward_kinematics(&q);
    let mut carried: Vec<(Point3<f64>, f64)> =
        vec![(vector("cube.position", row).into(), scene.bodies["cube"].mass.unwrap().0)];
    for link in (1..tree.links.len()).rev() {
        carried.push((poses[link] * tree.links[link].centre, tree.links[link].mass));
        let Some(joint) = tree.links[link].joint.as_ref().filter(|joint| joint.name.contains("arm/joint")) else {
            continue;
        };
        let axis = poses[link] * joint.axis.into_inner();
        let moment: Vector3<f64> = carried
            .iter()
            .map(|(at, mass)| {
                (at.coords - poses[link].translation.vector).cross(&Vector3::new(0.0, 0.0, mass * 9.80665))
            })
            .sum();
        let (found, expected) = (efforts[joint.dof][row], axis.dot(&moment));
        assert!(
            (found - expected).abs() < 0.05 + 0.02 * expected.abs(),
            "{}: {found} N m, expected {expected}",
            joint.name
        );
    }
}
