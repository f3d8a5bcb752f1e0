//! From fingers to jaws: converts the contacts of a thumb and several fingers to those of a gripper.
//!
//! The thumb's contact stays. The contact of the other jaw is the mean of the other fingers' contacts, projected onto the object's surface. Its force is the sum of
//! their forces, projected into the friction cone. If it exceeds the limit of a jaw, the forces of both jaws are scaled down together, so that they stay in balance.

use crate::model::gripper::Jaws;
use crate::model::hand::HandModel;
use nalgebra::{Point3, Vector3};
use teachtree_base::geometry::{face_normal, surface_distance};
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;
use teachtree_command::{Contact, GraspSpec, Segment, Task, Tip, into_cone};

/// A grasp of fingers as a grasp of jaws.
struct JawContact {
    /// The jaw that replaces several fingers, and these fingers.
    jaw: Finger,
    fingers: Vec<Finger>,
    /// Its contact.
    contact: Contact,
    /// The vectors from the mean of the fingers' tips to its tip, and from the middle of all tips to the middle of the jaws' tips; object frame, m.
    tip_off: Vector3<f64>,
    hand_off: Vector3<f64>,
}

impl Jaws {
    /// Converts a task of the operator's fingers, whose tips have a radius (m), to these jaws of a hand.
    pub(crate) fn take_over(&self, task: &mut Task, hand: &HandModel, object: &Body, tip_radius: f64) {
        let most = [&self.pair[0], &self.pair[1]]
            .map(|jaw| (jaw.finger, hand.finger(jaw.finger).map_or(0.0, |model| model.force)));
        for index in 0..task.grasps.len() {
            let taken = self.taken(&task.grasps[index], object, tip_radius);
            let grasp = &mut task.grasps[index];
            grasp.contacts.retain(|contact| contact.finger == Finger::Thumb);
            grasp.contacts.extend(taken.iter().map(|taken| taken.contact.clone()));
            for segment in task.segments.iter_mut().filter(|segment| segment.grasp == Some(index)) {
                let thumb = segment.tips.iter().find(|tip| tip.finger == Finger::Thumb).cloned();
                let other = taken.as_ref().map(|taken| taken.tip(segment));
                segment.tips = thumb.into_iter().chain(other).collect();
                within(&mut segment.tips, &most);
                let off = taken.as_ref().map_or_else(Vector3::zeros, |taken| taken.hand_off);
                for place in &mut segment.hand {
                    *place = (Vector3::from(*place) + off).into();
                }
            }
        }
    }

    /// Returns the replacement of the fingers opposite the thumb; `None` if only the thumb touches.
    fn taken(&self, grasp: &GraspSpec, object: &Body, tip_radius: f64) -> Option<JawContact> {
        let (thumb, others): (Vec<&Contact>, Vec<&Contact>) =
            grasp.contacts.iter().partition(|contact| contact.finger == Finger::Thumb);
        if others.is_empty() {
            return None;
        }
        let tip = |point: Vector3<f64>, normal: Vector3<f64>| point + normal * tip_radius;
        let centre = |contact: &&Contact| tip(contact.point.into(), contact.normal.into());
        let mean = middle(others.iter().map(centre));
        let normals: Vector3<f64> = others.iter().map(|contact| Vector3::from(contact.normal)).sum();
        let seen = Point3::from(mean);
        // Without a shape, the mean is taken as it is.
        let (point, normal) = match face_normal(object, &seen) {
            Some(normal) => (mean - normal * surface_distance(object, &seen), normal),
            None => {
                let normal = normals.try_normalize(1e-9)?;
                (mean - normal * tip_radius, normal)
            }
        };
        let own = tip(point, normal);
        let before = middle(thumb.iter().chain(&others).map(centre));
        let after = middle(thumb.iter().map(centre).chain([own]));
        let jaw = self.opponent(Finger::Thumb);
        Some(JawContact {
            jaw,
            fingers: others.iter().map(|contact| contact.finger).collect(),
            contact: Contact { finger: jaw, point: point.into(), normal: normal.into() },
            tip_off: own - mean,
            hand_off: after - before,
        })
    }
}

impl JawContact {
    /// Returns the tip of the jaw during a segment: the center of the fingertips and the sum of their forces. The demonstrated force is present if it was
    /// measured for all fingers.
    fn tip(&self, segment: &Segment) -> Tip {
        let tips: Vec<&Tip> = segment.tips.iter().filter(|tip| self.fingers.contains(&tip.finger)).collect();
        let normal = Vector3::from(self.contact.normal);
        let at = |index: usize| -> ([f64; 3], [f64; 3]) {
            let position = middle(tips.iter().map(|tip| Vector3::from(tip.position[index]))) + self.tip_off;
            let force: Vector3<f64> = tips.iter().map(|tip| Vector3::from(tip.force[index])).sum();
            (position.into(), into_cone(force, &normal).0.into())
        };
        let (position, force) = (0..segment.object.len()).map(at).unzip();
        let demonstrated = |index: usize| -> Option<[f64; 3]> {
            let forces = tips.iter().map(|tip| tip.demonstrated_force.get(index).map(|force| Vector3::from(*force)));
            Some(forces.sum::<Option<Vector3<f64>>>()?.into())
        };
        let demonstrated = (0..segment.object.len()).map(demonstrated).collect::<Option<_>>();
        Tip { finger: self.jaw, position, force, demonstrated_force: demonstrated.unwrap_or_default() }
    }
}

/// Scales the forces of jaws down together to the limits of all.
fn within(tips: &mut [Tip], most: &[(Finger, f64)]) {
    let may = |tip: &Tip| most.iter().find(|(finger, _)| *finger == tip.finger).map_or(f64::INFINITY, |it| it.1);
    let samples = tips.iter().map(|tip| tip.force.len()).min().unwrap_or_default();
    for index in 0..samples {
        let asked = tips.iter().map(|tip| Vector3::from(tip.force[index]).norm() / may(tip)).fold(0.0, f64::max);
        for tip in tips.iter_mut().filter(|_| asked > 1.0) {
            tip.force[index] = (Vector3::from(tip.force[index]) / asked).into();
        }
    }
}

fn middle(points: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let (sum, count) = points.fold((Vector3::zeros(), 0.0), |(sum, count), point| (sum + point, count + 1.0));
    sum / f64::max(count, 1.0)
}
