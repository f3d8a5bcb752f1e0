//! Arms of links without masses, as many URDFs have them. Without an inertia of its own, such an arm cannot be controlled.

use super::robot::Robot;
use std::collections::BTreeSet;
use teachtree_description::limits::SPEEDS_UP_S;

/// The motor of a joint without load reaches its speed in this time with its full torque, s. Ours: a tenth of the time that is allowed with load.
const MOTOR_SPEEDS_UP_S: f64 = SPEEDS_UP_S / 10.0;

impl Robot {
    /// Returns the degrees of freedom of the arms of its hands that move no mass, in order.
    pub fn massless_arm(&self) -> Vec<usize> {
        let mut loaded = vec![false; self.tree.dofs.len()];
        for (link, _) in self.tree.links.iter().enumerate().filter(|(_, link)| link.mass > 0.0) {
            for joint in self.tree.joints_above(link).filter_map(|above| self.tree.links[above].joint.as_ref()) {
                loaded[joint.dof] = true;
            }
        }
        let arms: BTreeSet<usize> = self.hands.values().flat_map(|hand| &hand.arm).copied().collect();
        arms.into_iter().filter(|dof| !loaded[*dof]).collect()
    }

    /// Gives these degrees of freedom the inertia of a motor, unless the file states a larger one: full torque brings it to its speed in 25 ms.
    pub(super) fn add_motors(&mut self) {
        for dof in self.massless_arm() {
            let dof = &mut self.tree.dofs[dof];
            dof.armature = dof.armature.max(MOTOR_SPEEDS_UP_S * dof.torque / dof.speed);
        }
    }
}
