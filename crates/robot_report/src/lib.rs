//! The page of what a robot did: pictures of it at each primitive (the paper's Figure 6), the thumb's force desired and achieved (Figure 7), the
//! total force on the object (Figure 8), joints and manipulability. Drawn without a display, one file that needs no network.

pub mod certificate;
mod framing;
mod grasps;
mod json;
mod motion;
mod picture;
mod plot;
mod text;

use framing::{Framing, framing};
pub use json::json;
use nalgebra::Vector3;
use picture::picture;
use plot::{Line, Plot, Stroke};
use teachtree_analysis::number::decimals;
use teachtree_base::hands::Finger;
use teachtree_command::Commands;
use teachtree_report::page;
use teachtree_report::svg::{escape, scrolled};
use teachtree_robot::JointKind;
use teachtree_robot::simulation::Performance;
use teachtree_robot::simulation::trace::{FingerForce, Trace, TraceSample};
use teachtree_robot::simulation::warnings::{Warning, warnings};
pub use text::{format_clearance, format_outcomes, format_performance};

/// Names of the components of a vector.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Writes the page.
pub fn page(commands: &Commands, performed: &Performance) -> String {
    let Performance { outcomes, nearest, collisions, trace, .. } = performed;
    let warnings = warnings(nearest, collisions);
    let robot = trace.limbs.first().map_or("", |limb| limb.robot.name.as_str());
    let title = format!("{} – robot `{}`", escape(&commands.log), escape(robot));
    let mut html = String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    html.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    html.push_str(&format!(
        "<title>{title}</title>\n<style>\n{}{}</style>\n</head>\n<body>\n",
        page::STYLE,
        include_str!("page.css")
    ));
    html.push_str(&format!("<h1>{title}</h1>\n"));
    html.push_str(&page::PLACE.replace("Replay of the demonstration", "Replay of the robot"));
    html.push_str("<div id=\"drawings\">\n");
    if !warnings.is_empty() {
        let item = |warning: &Warning| format!("<li>Warning: {}.</li>\n", escape(&warning.message));
        html.push_str(&format!("<ul class=\"causes\">\n{}</ul>\n", warnings.iter().map(item).collect::<String>()));
    }
    html.push_str(
        "<p>Each picture shows the middle of a primitive, all from one place; its arrows are the forces of the fingertips on the object. \
         In the plots, forces are those on the object, in its frame: dotted as demonstrated, dashed as commanded, solid as exerted.</p>\n",
    );
    // The tasks of two hands may run at the same time.
    let shown: Vec<&TraceSample> = (0..commands.tasks.len())
        .flat_map(|number| {
            middles(&trace.moments.iter().filter(|moment| moment.task == number).collect::<Vec<&TraceSample>>())
        })
        .collect();
    let framed = framing(trace, &shown);
    for (number, (task, outcome)) in commands.tasks.iter().zip(outcomes).enumerate() {
        let moments: Vec<&TraceSample> = trace.moments.iter().filter(|moment| moment.task == number).collect();
        let verdict = outcome.verdict().name();
        let (off, turned) = (decimals(outcome.off * 1e3, 1), decimals(outcome.turned.to_degrees(), 1));
        let ended = outcome.fell_s.map_or_else(
            || format!("{off} mm and {turned}° from where the demonstration left it"),
            |fell_s| format!("Fell off after {} s", decimals(fell_s, 1)),
        );
        html.push_str(&format!(
            "<section>\n<h2>{}{} of <code>{}</code>: {verdict}</h2>\n<p>{ended}; palm within {} mm of its path, \
             forces {} N off the commanded ones on average, {} N at most, {} their profile.{}</p>\n",
            if trace.limbs.len() > 1 { format!("{} hand, ", outcome.side) } else { String::new() },
            escape(&task.task),
            escape(&task.object),
            decimals(outcome.palm_error * 1e3, 1),
            decimals(outcome.forces.error, 2),
            decimals(outcome.largest_force, 2),
            if outcome.forces.kept() { "within" } else { "outside" },
            outcome.searched.map_or_else(String::new, |searched| format!(" The {searched}.")),
        ));
        let changes = outcome.forces.grip_changes();
        let remarks = outcome.causes.iter().map(ToString::to_string).chain(changes.iter().map(ToString::to_string));
        let remarks: String = remarks.map(|remark| format!("<li>{}</li>\n", escape(&remark))).collect();
        if !remarks.is_empty() {
            html.push_str(&format!("<ul class=\"causes\">\n{remarks}</ul>\n"));
        }
        html.push_str(&pictures(trace, &moments, &task.object, framed));
        html.push_str(&grasps::grasps(task));
        html.push_str(&scrolled("Forces, joints and torques"));
        for plot in plots(trace, &moments) {
            html.push_str(&plot.draw(&moments));
        }
        html.push_str("</div>\n</section>\n");
    }
    html.push_str("</div>\n");
    html.push_str(&page::elements(&motion::data(commands, trace, outcomes, &warnings)));
    html.push_str("</body>\n</html>\n");
    html
}

/// The middle of each primitive.
fn middles<'m>(moments: &[&'m TraceSample]) -> Vec<&'m TraceSample> {
    let runs = moments.chunk_by(|one, next| one.task == next.task && one.primitive == next.primitive);
    runs.filter_map(|run| run.get(run.len() / 2).copied()).collect()
}

/// A picture of the middle of each primitive.
fn pictures(trace: &Trace, moments: &[&TraceSample], object: &str, framed: Framing) -> String {
    let drawn = middles(moments).into_iter().map(|moment| {
        let caption = format!("{}, {} s", escape(&moment.primitive), decimals(moment.time_s, 2));
        format!("<figure>{}<figcaption>{caption}</figcaption></figure>\n", picture(trace, moment, object, framed))
    });
    format!("<div class=\"pictures\">\n{}</div>\n", drawn.collect::<String>())
}

/// What is plotted of a task.
fn plots(trace: &Trace, moments: &[&TraceSample]) -> Vec<Plot> {
    let mut plots = Vec::new();
    let fingers: Vec<Finger> =
        moments.first().map_or(Vec::new(), |first| first.forces.iter().map(|force| force.finger).collect());
    let pressing = |finger: &Finger| {
        moments
            .iter()
            .any(|moment| moment.forces.iter().any(|force| force.finger == *finger && force.commanded.norm() > 0.0))
    };
    // The thumb as in the paper; where it takes no part, the first finger that does.
    let shown = fingers.iter().find(|finger| **finger == Finger::Thumb && pressing(finger));
    if let Some(shown) = shown.or_else(|| fingers.iter().find(|finger| pressing(finger))) {
        let of =
            |moment: &TraceSample| moment.forces.iter().find(|force| force.finger == *shown).map_or_else(zeros, three);
        plots.extend(forces(&format!("force of the {shown}"), moments, of));
    }
    let total = |moment: &TraceSample| {
        moment.forces.iter().map(three).fold(zeros(), |[a, b, c], [d, e, f]| [a + d, b + e, c + f])
    };
    plots.extend(forces("total force on the object", moments, total));

    let place = moments.first().map_or(0, |moment| moment.limb);
    let Some(limb) = trace.limbs.get(place) else { return plots };
    let Some(hand) = limb.robot.hands.get(&limb.side) else { return plots };
    let q = |moment: &TraceSample| moment.stances.get(place).map_or_else(Vec::new, |stance| stance.q.clone());
    let joints = |dofs: &[usize]| -> Vec<Line> {
        let line = |(place, dof): (usize, &usize)| {
            let value = |moment: &&TraceSample| q(moment).get(*dof).copied().unwrap_or(f64::NAN);
            let name =
                limb.robot.tree.dofs.get(*dof).map_or("", |dof| dof.name.rsplit('/').next().unwrap_or(&dof.name));
            Line { name: name.into(), color: place, stroke: Stroke::Solid, values: moments.iter().map(value).collect() }
        };
        dofs.iter().enumerate().map(line).collect()
    };
    let unit = |dofs: &[usize]| {
        let joints = limb.robot.tree.links.iter().filter_map(|link| link.joint.as_ref());
        let mut kinds = joints.filter(|joint| dofs.contains(&joint.dof)).map(|joint| joint.kind);
        match kinds.next() {
            Some(JointKind::Prismatic) if kinds.all(|kind| kind == JointKind::Prismatic) => "m",
            Some(JointKind::Revolute) if kinds.all(|kind| kind == JointKind::Revolute) => "rad",
            _ => "rad or m",
        }
    };
    if !hand.arm.is_empty() {
        plots.push(Plot {
            title: format!("joints of the arm, {}", unit(&hand.arm)),
            lines: joints(&hand.arm),
            shortest: 0.1,
        });
    }
    if hand.jaws.is_some() {
        let opening = |moment: &&TraceSample| hand.opening(&q(moment)).unwrap_or(f64::NAN) * 1e3;
        let values = moments.iter().map(opening).collect();
        let line = Line { name: "opening".into(), color: 0, stroke: Stroke::Solid, values };
        plots.push(Plot { title: "opening of the jaws, mm".into(), lines: vec![line], shortest: 1.0 });
        return plots;
    }
    for finger in &hand.fingers {
        let title =
            format!("joints of the {} finger, {}", finger.finger, unit(&finger.dofs)).replace("thumb finger", "thumb");
        plots.push(Plot { title, lines: joints(&finger.dofs), shortest: 0.1 });
    }
    let measures = hand.fingers.iter().enumerate().map(|(place, finger)| {
        let measure = |moment: &&TraceSample| finger.measure(&finger.angles(&q(moment)));
        let values = moments.iter().map(measure).collect();
        Line { name: finger.finger.name().into(), color: place, stroke: Stroke::Solid, values }
    });
    let title = "manipulability of each finger with its freedom from joint limits".into();
    plots.push(Plot { title, lines: measures.collect(), shortest: 0.05 });
    plots
}

fn zeros() -> [Vector3<f64>; 3] {
    [Vector3::zeros(); 3]
}

/// Returns the demonstrated, commanded and exerted force; the first is NaN if it was not measured.
fn three(force: &FingerForce) -> [Vector3<f64>; 3] {
    [force.demonstrated.unwrap_or_else(|| Vector3::repeat(f64::NAN)), force.commanded, force.exerted]
}

/// The lines of a force plot: name, index of the color, and stroke.
const FORCES: [(&str, usize, Stroke); 3] =
    [("demonstrated", 2, Stroke::Dotted), ("commanded", 1, Stroke::Dashed), ("exerted", 0, Stroke::Solid)];

/// Returns a plot per component with the demonstrated, commanded and exerted force.
fn forces(title: &str, moments: &[&TraceSample], of: impl Fn(&TraceSample) -> [Vector3<f64>; 3]) -> Vec<Plot> {
    let all: Vec<[Vector3<f64>; 3]> = moments.iter().map(|moment| of(moment)).collect();
    let plot = |(axis, name): (usize, &str)| {
        let line = |(which, (name, color, stroke)): (usize, (&str, usize, Stroke))| {
            let values: Vec<f64> = all.iter().map(|three| three[which][axis]).collect();
            values.iter().any(|value| !value.is_nan()).then(|| Line { name: name.into(), color, stroke, values })
        };
        // The exerted force is drawn first, below the other lines.
        let lines = FORCES.into_iter().enumerate().rev().filter_map(line).collect();
        Plot { title: format!("{title}, {name}, N"), lines, shortest: 0.2 }
    };
    AXES.into_iter().enumerate().map(plot).collect()
}
