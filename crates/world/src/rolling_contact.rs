//! Rolling contacts: contacts of round sides are recomputed as bodies turn.
//!
//! parry keeps the points and the normal of a contact while bodies turn by less than a degree. On a face that is exact; on a round side the contact
//! would go along with the side, and what carries a lying cylinder would push it on from behind, faster and faster.

use parry3d::math::{Pose, Real, Vector};
use parry3d::query::details::{ContactManifoldsWorkspace, NormalConstraints, ShapeCastOptions};
use parry3d::query::{
    ClosestPoints, Contact, ContactManifold, DefaultQueryDispatcher, NonlinearRigidMotion, PersistentQueryDispatcher,
    QueryDispatcher, QueryDispatcherChain, ShapeCastHit, ShapeDistance, ShapeIntersection, Unsupported,
};
use parry3d::shape::Shape;

/// Returns parry's dispatcher, with recomputed contacts of round sides.
pub(super) fn dispatcher() -> QueryDispatcherChain<RollingDispatcher, DefaultQueryDispatcher> {
    RollingDispatcher.chain(DefaultQueryDispatcher)
}

/// Answers nothing itself: it discards the cached manifold of rolling contacts, and leaves the rest to the next dispatcher.
pub(super) struct RollingDispatcher;

/// A contact is of this step while the bodies have not turned by more since it was made, rad: what lies still keeps its contacts, and what rolls is pushed on
/// by less than a ten-thousandth of its weight.
const TURNED: Real = 2e-5;

impl RollingDispatcher {
    /// Discards a contact of a round side that has turned.
    fn let_go<D, C: Default + Copy>(
        pos12: &Pose,
        one: &dyn Shape,
        other: &dyn Shape,
        manifold: &mut ContactManifold<D, C>,
    ) {
        let round = one.as_cylinder().is_some() || other.as_cylinder().is_some();
        if round && manifold.local_n1.cross(pos12.rotation * manifold.local_n2).length() > TURNED {
            manifold.mark_shapes_deformed();
        }
    }
}

impl<D, C: Default + Copy> PersistentQueryDispatcher<D, C> for RollingDispatcher {
    fn contact_manifolds(
        &self,
        pos12: &Pose,
        one: &dyn Shape,
        other: &dyn Shape,
        _: Real,
        manifolds: &mut Vec<ContactManifold<D, C>>,
        _: &mut Option<ContactManifoldsWorkspace>,
    ) -> Result<(), Unsupported> {
        manifolds.iter_mut().for_each(|manifold| Self::let_go(pos12, one, other, manifold));
        Err(Unsupported)
    }

    fn contact_manifold_convex_convex(
        &self,
        _: &Pose,
        _: &dyn Shape,
        _: &dyn Shape,
        _: Option<&dyn NormalConstraints>,
        _: Option<&dyn NormalConstraints>,
        _: Real,
        _: &mut ContactManifold<D, C>,
    ) -> Result<(), Unsupported> {
        Err(Unsupported)
    }
}

impl QueryDispatcher for RollingDispatcher {
    fn intersection_test(&self, _: &Pose, _: &dyn Shape, _: &dyn Shape) -> Result<ShapeIntersection, Unsupported> {
        Err(Unsupported)
    }

    fn distance(&self, _: &Pose, _: &dyn Shape, _: &dyn Shape) -> Result<ShapeDistance, Unsupported> {
        Err(Unsupported)
    }

    fn contact(&self, _: &Pose, _: &dyn Shape, _: &dyn Shape, _: Real) -> Result<Option<Contact>, Unsupported> {
        Err(Unsupported)
    }

    fn closest_points(&self, _: &Pose, _: &dyn Shape, _: &dyn Shape, _: Real) -> Result<ClosestPoints, Unsupported> {
        Err(Unsupported)
    }

    fn cast_shapes(
        &self,
        _: &Pose,
        _: Vector,
        _: &dyn Shape,
        _: &dyn Shape,
        _: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        Err(Unsupported)
    }

    fn cast_shapes_nonlinear(
        &self,
        _: &NonlinearRigidMotion,
        _: &dyn Shape,
        _: &NonlinearRigidMotion,
        _: &dyn Shape,
        _: Real,
        _: Real,
        _: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        Err(Unsupported)
    }
}
