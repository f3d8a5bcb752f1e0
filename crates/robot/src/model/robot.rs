//! A robot: a tree of links with hands on it.

use crate::model::hand::HandModel;
use indexmap::IndexMap;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_description::tree::KinematicTree;

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
}

impl Robot {
    /// The name of a joint of the tree at its controller.
    pub fn controller_name<'a>(&'a self, joint: &'a str) -> &'a str {
        self.joint_names.get(joint).map_or(joint, String::as_str)
    }

    /// How large its hands are beside human hands, the mean of them: see [`HandModel::scale`]; 1 without hands.
    pub fn hands_scale(&self) -> f64 {
        let sum: f64 = self.hands.values().map(HandModel::scale).sum();
        if self.hands.is_empty() { 1.0 } else { sum / self.hands.len() as f64 }
    }
}
