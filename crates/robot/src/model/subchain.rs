//! One hand of a robot with its arm, as a separate robot, so that a simulation does not compute links that do not move.

use super::hand;
use crate::kinematics::finger::FingerSpec;
use crate::model::robot::Robot;
use indexmap::IndexMap;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_description::tree::KinematicTree;

impl Robot {
    /// Returns the hand of this side and all links between it and the root.
    ///
    /// # Errors
    /// The robot does not have this hand.
    pub fn limb(&self, side: Side) -> Result<Self, InputError> {
        let lacks = || InputError::new(self.name.clone(), format!("has no {side} hand"));
        let hand = self.hands.get(&side).ok_or_else(lacks)?;
        let mut kept = vec![false; self.tree.links.len()];
        let mut at = hand.palm;
        while at != 0 {
            kept[at] = true;
            at = self.tree.links[at].parent;
        }
        kept[0] = true;
        for (index, kept) in kept.iter_mut().enumerate() {
            let mut above = index;
            while above != 0 && above != hand.palm {
                above = self.tree.links[above].parent;
            }
            *kept |= above == hand.palm;
        }
        let mut place = vec![0; self.tree.links.len()];
        let mut dof_place: Vec<Option<usize>> = vec![None; self.tree.dofs.len()];
        let mut limb = Self {
            name: self.name.clone(),
            tree: KinematicTree::default(),
            hands: IndexMap::new(),
            joint_names: self.joint_names.clone(),
            oddities: Vec::new(),
        };
        for (index, link) in self.tree.links.iter().enumerate().filter(|(index, _)| kept[*index]) {
            place[index] = limb.tree.links.len();
            let mut link = link.clone();
            link.parent = place[link.parent];
            if let Some(joint) = &mut link.joint {
                let dof = *dof_place[joint.dof].get_or_insert_with(|| {
                    limb.tree.dofs.push(self.tree.dofs[joint.dof].clone());
                    limb.tree.dofs.len() - 1
                });
                joint.dof = dof;
            }
            limb.tree.links.push(link);
        }
        let specs: Vec<_> = hand
            .fingers
            .iter()
            .map(|finger| FingerSpec { link: place[finger.spec.link], ..finger.spec.clone() })
            .collect();
        let made = hand::build(&limb.tree, place[hand.palm], &specs)
            .map_err(|(_, message)| InputError::new(self.name.clone(), message))?;
        limb.hands.insert(side, made);
        Ok(limb)
    }
}
