//! A robot: a tree of links with hands on it.

use crate::model::hand::HandModel;
use indexmap::IndexMap;
use std::collections::BTreeMap;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_description::tree::KinematicTree;
use teachtree_description::urdf::Oddity;

/// A robot.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// Its links and joints.
    pub tree: KinematicTree,
    /// Its hands, on links of the tree.
    pub hands: IndexMap<Side, HandModel>,
    /// The names of joints at their controllers, by the names in the tree, where both differ.
    pub joint_names: BTreeMap<String, String>,
    /// URDF elements that were not read exactly, on links that no hand or arm needs.
    pub oddities: Vec<Oddity>,
}

impl Robot {
    /// Refuses elements that were not read exactly on a link of a hand or of its arm.
    pub(crate) fn check_oddities(&self) -> Result<(), InputError> {
        if self.oddities.is_empty() {
            return Ok(());
        }
        let limbs = self.hands.keys().map(|side| self.limb(*side)).collect::<Result<Vec<Self>, InputError>>()?;
        let matters = |oddity: &&Oddity| limbs.iter().any(|limb| limb.tree.link(&oddity.link).is_some());
        self.oddities.iter().find(matters).map_or(Ok(()), |oddity| Err(oddity.error.clone()))
    }

    /// Returns an element that was not read exactly on one of these links or their ancestors.
    pub(crate) fn oddity_above(&self, links: &[String]) -> Option<InputError> {
        let mut above: Vec<usize> = links.iter().filter_map(|name| self.tree.link(name)).collect();
        let mut names = vec![];
        while let Some(at) = above.pop() {
            let Some(link) = self.tree.links.get(at) else { continue };
            names.push(link.name.as_str());
            above.extend((at > 0).then_some(link.parent));
        }
        let matters = |oddity: &&Oddity| names.contains(&oddity.link.as_str());
        self.oddities.iter().find(matters).map(|oddity| oddity.error.clone())
    }

    /// Returns the controller's name of a joint of the tree.
    pub fn controller_name<'a>(&'a self, joint: &'a str) -> &'a str {
        self.joint_names.get(joint).map_or(joint, String::as_str)
    }

    /// Returns the mean scale of its hands relative to human hands (see [`HandModel::scale`]); 1 without hands.
    pub fn hands_scale(&self) -> f64 {
        let sum: f64 = self.hands.values().map(HandModel::scale).sum();
        if self.hands.is_empty() { 1.0 } else { sum / self.hands.len() as f64 }
    }
}
