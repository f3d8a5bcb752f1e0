//! Robots on robots: the `parts` of a robot file.

use super::joint_names::keep_unique;
use super::{MAX_DEPTH, PartFile, RobotFile, RobotFiles, SourceMap, beside, nested, placed, shipped};
use crate::kinematics::finger::FingerSpec;
use crate::model::hand;
use crate::model::robot::Robot;
use indexmap::IndexMap;
use std::collections::BTreeMap;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_description::limits::MAX_LINKS;
use teachtree_description::tree::{Dof, KinematicTree, Link};
use teachtree_description::urdf::Oddity;

/// The robot that the parts make, each on a link of one before it or in the world.
pub(super) fn assembly(
    file: RobotFile,
    places: &SourceMap<'_>,
    files: RobotFiles<'_>,
    depth: usize,
) -> Result<Robot, InputError> {
    let refuse = |part: &str, message: String| places.error("parts", part, message);
    if depth >= MAX_DEPTH {
        return Err(refuse("", format!("are nested more than {MAX_DEPTH} deep")));
    }
    let mut links = vec![Link::massless("world", Vec::new())];
    let (tree, joint_names) = (KinematicTree::default(), BTreeMap::new());
    let mut whole = Robot { name: file.name, tree, hands: IndexMap::new(), joint_names, oddities: Vec::new() };
    let mut hands: Vec<(Side, String, usize, Vec<FingerSpec>)> = Vec::new();
    for (part, PartFile { robot, side: given, on, at, turned, source }) in &file.parts {
        if source.trim().is_empty() {
            return Err(refuse(part, "has an empty `source`".into()));
        }
        let robot = if shipped::text(robot).is_some() { robot.clone() } else { beside(places.file, robot) };
        let model = nested(&robot, files, depth + 1)?;
        let parent = match on {
            None => 0,
            Some(on) => links.iter().position(|link| link.name == *on).ok_or_else(|| {
                refuse(part, format!("is on `{on}`, which is not a link of a part before it; expected `part/link`"))
            })?,
        };
        let (base, first_dof) = (links.len(), whole.tree.dofs.len());
        let at = placed(*at, *turned, places, "parts", part)?;
        for (index, mut link) in model.tree.links.iter().cloned().enumerate() {
            link.name = format!("{part}/{}", link.name);
            (link.parent, link.parent_from_joint) =
                if index == 0 { (parent, at) } else { (link.parent + base, link.parent_from_joint) };
            if let Some(joint) = &mut link.joint {
                joint.name = format!("{part}/{}", joint.name);
                joint.dof += first_dof;
            }
            links.push(link);
        }
        whole
            .tree
            .dofs
            .extend(model.tree.dofs.into_iter().map(|dof| Dof { name: format!("{part}/{}", dof.name), ..dof }));
        let named = model.joint_names.iter().map(|(joint, name)| (format!("{part}/{joint}"), name.clone()));
        whole.joint_names.extend(named);
        let odd = model.oddities.into_iter();
        whole.oddities.extend(odd.map(|it| Oddity { link: format!("{part}/{}", it.link), ..it }));
        if given.is_some() && model.hands.len() != 1 {
            return Err(refuse(part, format!("has a `side` and {} hands, expected one", model.hands.len())));
        }
        for (own, hand) in model.hands {
            let side = given.unwrap_or(own);
            if hands.iter().any(|(other, ..)| *other == side) {
                return Err(refuse(part, format!("is a second {side} hand")));
            }
            let specs: Vec<FingerSpec> = hand.fingers.iter().map(|finger| finger.spec.shifted(base)).collect();
            hands.push((side, part.clone(), hand.palm + base, specs));
        }
        if links.len() > MAX_LINKS {
            return Err(refuse(part, format!("makes more than {MAX_LINKS} links")));
        }
    }
    whole.tree.links = links;
    keep_unique(&mut whole.joint_names);
    for (side, part, palm, specs) in hands {
        let hand = hand::build(&whole.tree, palm, &specs).map_err(|(_, message)| refuse(&part, message))?;
        whole.hands.insert(side, hand);
    }
    Ok(whole)
}
