//! The grasps of a task, with the factors of their measures by finger.

use std::collections::BTreeSet;
use teachtree_analysis::number::decimals;
use teachtree_command::{GraspCriterion, GraspSpec, MappedFinger, MappedGrasp, Task};
use teachtree_report::svg::escape;

/// Draws a table of the grasps of a task.
pub(super) fn grasps(task: &Task) -> String {
    let mapped: Vec<&MappedGrasp> = task.grasps.iter().filter_map(|grasp: &GraspSpec| grasp.mapped.as_ref()).collect();
    if mapped.is_empty() {
        return String::new();
    }
    let rows: String = mapped.iter().enumerate().map(|(at, grasp)| rows(at + 1, grasp)).collect();
    let brief: BTreeSet<&str> = task.grasps.iter().flat_map(|grasp| &grasp.brief).map(|finger| finger.name()).collect();
    let brief = brief
        .into_iter()
        .map(|finger| format!("<p>The operator's {} touched too briefly to take part.</p>\n", escape(finger)));
    let table = format!(
        "<table class=\"grasps\">\n<tr><th>grasp</th><th>measure</th><th>margin of friction</th><th>finger</th>\
         <th>manipulability</th><th>freedom from joint limits</th><th>pad from the normal</th><th>alignment</th></tr>\n\
         {rows}</table>\n"
    );
    table + &brief.collect::<String>()
}

/// The rows of a grasp, one for each finger.
fn rows(number: usize, grasp: &MappedGrasp) -> String {
    let count = grasp.fingers.len();
    let chosen = match grasp.criterion {
        GraspCriterion::Quality => "",
        GraspCriterion::Manipulability => " by manipulability",
    };
    let margin = grasp.friction_margin_percent().map_or_else(String::new, |percent| format!("{percent:.0} %"));
    let measure = decimals(grasp.measure, 3);
    let whole = format!(
        "<td rowspan=\"{count}\">{number}{chosen}</td><td rowspan=\"{count}\">{measure}</td><td rowspan=\"{count}\">{margin}</td>"
    );
    let row = |(at, finger): (usize, &MappedFinger)| {
        let first = if at == 0 { whole.as_str() } else { "" };
        // A jaw has no manipulability.
        let manipulability = if grasp.opening.is_some() { "–".into() } else { decimals(finger.manipulability, 3) };
        let alignment = finger.alignment.map_or_else(String::new, |alignment| decimals(alignment, 2));
        format!(
            "<tr>{first}<td>{}</td><td>{manipulability}</td><td>{}</td><td>{}°</td><td>{alignment}</td></tr>\n",
            escape(finger.finger.name()),
            decimals(finger.freedom, 2),
            decimals(finger.pad_angle_deg, 0)
        )
    };
    grasp.fingers.iter().enumerate().map(row).collect()
}
