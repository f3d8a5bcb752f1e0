//! A picture of the robot and what it handles: an orthographic view from across the table, painted from the farthest to the nearest.

use super::framing::{self, Framing, WIDTH, is_of_hand, poses};
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::geometry::pose;
use teachtree_base::scene::{Body, Role, Shape};
use teachtree_report::svg::length;
use teachtree_robot::simulation::trace::{Trace, TraceSample};
use teachtree_robot::{CollisionShape, Polytope};

/// A round body has this many sides.
const SIDES: usize = 20;
/// A newton is drawn this long, m.
const NEWTON_M: f64 = 0.030;
/// Least light on a face.
const SHADE: f64 = 0.55;

/// Something to be painted: how far away it is, and its drawing.
struct PaintedShape {
    depth: f64,
    svg: String,
}

/// The view in the making.
pub(super) struct View {
    framing: Framing,
    painted: Vec<PaintedShape>,
}

/// What a shape belongs to, as the class of its drawing, and its color.
#[derive(Clone, Copy)]
struct Paint {
    class: &'static str,
    color: &'static str,
}

/// Draws a moment; `object` is what the task is about.
pub(super) fn picture(trace: &Trace, moment: &TraceSample, object: &str, framing: Framing) -> String {
    let poses = poses(trace, moment);
    let hand = trace.limbs.get(moment.limb).and_then(|limb| limb.robot.hands.get(&limb.side));
    let own = poses.get(moment.limb);
    let mut view = View { framing, painted: Vec::new() };
    for ((name, body), pose) in trace.scene.bodies.iter().zip(&moment.bodies) {
        let paint = match body.role {
            Role::Support | Role::Wall => None,
            _ if name == object => Some(Paint { class: "object", color: "task" }),
            _ => Some(Paint { class: "object", color: "solid" }),
        };
        view.body(body, pose, paint);
    }
    for (place, (limb, poses)) in trace.limbs.iter().zip(&poses).enumerate() {
        let palm = limb.robot.hands.get(&limb.side).map(|hand| hand.palm);
        // The hand at work is darker than the other one.
        let color = if place == moment.limb { "robot" } else { "other" };
        for (at, (link, pose)) in limb.robot.tree.links.iter().zip(poses).enumerate() {
            let of_hand = palm.is_some_and(|palm| is_of_hand(&limb.robot, palm, at));
            let paint = Paint { class: if of_hand { "hand" } else { "arm" }, color };
            for solid in &link.solids {
                match solid {
                    CollisionShape::Capsule(from, to, radius) => view.capsule(pose * from, pose * to, *radius, paint),
                    CollisionShape::Box(at, half) => view.cuboid(&(pose * at), half, Some(paint)),
                    CollisionShape::Piece(at, polytope) => view.piece(&(pose * at), polytope, paint),
                }
            }
        }
    }
    let mut forces = false;
    if let Some((hand, poses)) = hand.zip(own) {
        let object_pose = trace.scene.bodies.get_index_of(object).and_then(|at| moment.bodies.get(at));
        for (finger, force) in hand.fingers.iter().zip(&moment.forces) {
            let tip = poses.get(finger.tip_link).map(|pose| pose * finger.tip_in_link);
            if let (Some(tip), Some(object)) = (tip, object_pose) {
                view.capsule(tip, tip, finger.radius, Paint { class: "hand", color: "robot" });
                forces |= view.arrow(tip, object * force.exerted * NEWTON_M);
            }
        }
    }
    view.draw(&format!("the robot in {}, {:.2} s", moment.primitive, moment.time_s), forces)
}

impl View {
    /// Where a point is in the picture.
    fn seen(&self, point: &Point3<f64>) -> (f64, f64) {
        let Framing { height, scale, middle } = self.framing;
        let [right, up] = framing::across(point);
        (WIDTH / 2.0 + scale * (right - middle[0]), height / 2.0 - scale * (up - middle[1]))
    }

    fn depth(&self, point: &Point3<f64>) -> f64 {
        let [_, _, eye] = framing::axes();
        -point.coords.dot(&eye)
    }

    fn path(&self, corners: &[Point3<f64>]) -> String {
        let points = corners.iter().map(|corner| {
            let (x, y) = self.seen(corner);
            format!("{} {}", length(x), length(y))
        });
        format!("M{}Z", points.collect::<Vec<_>>().join("L"))
    }

    /// A flat face that is seen from its normal's side; without paint only its outline.
    fn face(&mut self, corners: &[Point3<f64>], normal: &Vector3<f64>, paint: Option<Paint>) {
        let [_, _, eye] = framing::axes();
        let facing = normal.dot(&eye);
        let path = self.path(corners);
        let Some(Paint { class, color }) = paint else {
            // What stands behind everything.
            let svg = format!(r#"<path d="{path}" fill="none" stroke="var(--line)"/>"#);
            self.painted.push(PaintedShape { depth: f64::INFINITY, svg });
            return;
        };
        if facing <= 0.0 {
            return;
        }
        let middle = corners.iter().map(|corner| corner.coords).sum::<Vector3<f64>>() / corners.len().max(1) as f64;
        let light = SHADE + (1.0 - SHADE) * normal.dot(&Vector3::new(0.3, 0.5, 0.81)).max(0.0);
        let svg = format!(
            r#"<path class="{class}" d="{path}" fill="color-mix(in srgb, var(--{color}) {}%, black)" stroke="var(--edge)" stroke-width="0.6" stroke-linejoin="round"/>"#,
            (light * 100.0).round()
        );
        self.painted.push(PaintedShape { depth: self.depth(&middle.into()), svg });
    }

    fn body(&mut self, body: &Body, world_from_body: &Isometry3<f64>, paint: Option<Paint>) {
        for part in &body.parts {
            let at = world_from_body * pose(part.at.map(|length| length.0), part.turned);
            match part.shape {
                Shape::Box(edges) => self.cuboid(&at, &(Vector3::from(edges.map(|edge| edge.0)) / 2.0), paint),
                Shape::Cylinder([radius, height]) => self.cylinder(&at, radius.0, height.0 / 2.0, paint),
                Shape::Ball(radius) => self.ball(&at, radius.0, paint),
            }
        }
    }

    fn cuboid(&mut self, at: &Isometry3<f64>, half: &Vector3<f64>, paint: Option<Paint>) {
        for axis in 0..3 {
            let (one, other) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in [-1.0, 1.0] {
                let corner = |a: f64, b: f64| {
                    let mut corner = Vector3::zeros();
                    (corner[axis], corner[one], corner[other]) = (side * half[axis], a * half[one], b * half[other]);
                    at * Point3::from(corner)
                };
                let mut normal = Vector3::zeros();
                normal[axis] = side;
                let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                self.face(&corners, &(at.rotation * normal), paint);
            }
        }
    }

    fn piece(&mut self, at: &Isometry3<f64>, polytope: &Polytope, paint: Paint) {
        for triangle in &polytope.triangles {
            let corners = triangle.map(|corner| at * polytope.points[corner]);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            if let Some(normal) = normal.try_normalize(0.0) {
                self.face(&corners, &normal, Some(paint));
            }
        }
    }

    fn cylinder(&mut self, at: &Isometry3<f64>, radius: f64, half: f64, paint: Option<Paint>) {
        let rim = |number: usize, height: f64| {
            let angle = std::f64::consts::TAU * number as f64 / SIDES as f64;
            at * Point3::new(radius * angle.cos(), radius * angle.sin(), height)
        };
        for number in 0..SIDES {
            let angle = std::f64::consts::TAU * (number as f64 + 0.5) / SIDES as f64;
            let normal = at.rotation * Vector3::new(angle.cos(), angle.sin(), 0.0);
            let corners = [rim(number, -half), rim(number + 1, -half), rim(number + 1, half), rim(number, half)];
            self.face(&corners, &normal, paint);
        }
        for side in [-1.0, 1.0] {
            let cap: Vec<Point3<f64>> = (0..SIDES).map(|number| rim(number, side * half)).collect();
            self.face(&cap, &(at.rotation * Vector3::z() * side), paint);
        }
    }

    fn ball(&mut self, at: &Isometry3<f64>, radius: f64, paint: Option<Paint>) {
        let centre = Point3::from(at.translation.vector);
        let (x, y) = self.seen(&centre);
        let fill = paint.map_or_else(|| "none".into(), |paint| format!("var(--{})", paint.color));
        let class = paint.map_or("", |paint| paint.class);
        let svg = format!(
            r#"<circle class="{class}" cx="{}" cy="{}" r="{}" fill="{fill}" stroke="var(--edge)" stroke-width="0.6"/>"#,
            length(x),
            length(y),
            length(radius * self.framing.scale)
        );
        self.painted.push(PaintedShape { depth: self.depth(&centre), svg });
    }

    fn capsule(&mut self, from: Point3<f64>, to: Point3<f64>, radius: f64, Paint { class, color }: Paint) {
        let ((x0, y0), (x1, y1)) = (self.seen(&from), self.seen(&to));
        let d = format!("M{} {}L{} {}", length(x0), length(y0), length(x1), length(y1));
        let wide = 2.0 * radius * self.framing.scale;
        let bar = |colour: &str, width: f64| {
            format!(
                r#"<path class="{class}" d="{d}" stroke="var(--{colour})" stroke-width="{}" stroke-linecap="round"/>"#,
                length(width)
            )
        };
        let svg = bar("edge", wide + 1.2) + &bar(color, wide);
        self.painted.push(PaintedShape { depth: self.depth(&nalgebra::center(&from, &to)), svg });
    }

    /// A force from a point, over everything; false when it is too short to be seen.
    fn arrow(&mut self, from: Point3<f64>, way: Vector3<f64>) -> bool {
        let ((x0, y0), (x1, y1)) = (self.seen(&from), self.seen(&(from + way)));
        let (dx, dy) = (x1 - x0, y1 - y0);
        let long = dx.hypot(dy);
        if long < 2.0 {
            return false;
        }
        let (ux, uy) = (dx / long, dy / long);
        let barb = |side: f64| (x1 - 6.0 * ux - side * 3.0 * uy, y1 - 6.0 * uy + side * 3.0 * ux);
        let ((ax, ay), (bx, by)) = (barb(1.0), barb(-1.0));
        let d = [x0, y0, x1, y1, ax, ay, x1, y1, bx, by].map(length);
        let svg = format!(
            r#"<path d="M{} {}L{} {}M{} {}L{} {}L{} {}" fill="none" stroke="var(--force)" stroke-width="2"/>"#,
            d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7], d[8], d[9]
        );
        self.painted.push(PaintedShape { depth: f64::NEG_INFINITY, svg });
        true
    }

    /// The picture; with a bar for the scale of forces where it has any.
    fn draw(mut self, label: &str, forces: bool) -> String {
        self.painted.sort_by(|one, other| other.depth.total_cmp(&one.depth));
        let painted: String = self.painted.into_iter().map(|painted| painted.svg).collect();
        let label = teachtree_report::svg::escape(label);
        let Framing { height, scale, .. } = self.framing;
        let newton = NEWTON_M * scale;
        let bar = if forces {
            let (y, end) = (length(height - 8.0), length(8.0 + newton));
            let (left, below) = (length(12.0 + newton), length(height - 4.0));
            format!(
                r#"<path d="M8 {y}H{end}" stroke="var(--force)" stroke-width="2"/><text x="{left}" y="{below}">1 N</text>"#
            )
        } else {
            String::new()
        };
        let height = length(height);
        format!("<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{label}\">{painted}{bar}</svg>")
    }
}
