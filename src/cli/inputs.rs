//! Reads YAML files that people write, scenes, operators, bindings, robots and project files, and reports what is wrong with them.

use std::path::Path;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::file_kind::FileKind;
use teachtree_base::yaml;
use teachtree_frames as stream;
use teachtree_frames::bind::BindingFile;
use teachtree_logs::read::text;
use teachtree_robot::{self as robot, CollisionShape, Link, Oddity, Robot};
use teachtree_session::binding_check::{self, BindingCheck};
use teachtree_session::project_file::ProjectFile;
use teachtree_session::{Error, ErrorInternals, RulesOptions, Scene, SceneInternals};

/// Maximum number of printed warnings about a URDF.
const ODDITIES: usize = 8;

/// Reads a text as a file of its kind; bindings are checked by rules, if there are any. Returns what there is to say of it.
///
/// # Errors
/// The first thing that is wrong, at `file:line:column` where that is known.
pub fn read(kind: FileKind, path: &Path, text: &str, rules: Option<RulesOptions>) -> Result<String, InputError> {
    let name = path.display().to_string();
    match kind {
        FileKind::Scene => {
            let scene = Scene::parse(&name, text).map_err(Error::into_input)?;
            return Ok(misplaced(&scene, text, &name));
        }
        FileKind::Binding => {
            let file = BindingFile::parse(text.into(), name)?;
            let Some(rules) = rules else {
                return stream::assume(path, &file).map(|_| String::new());
            };
            let checked = binding_check::check(path, &file, rules).map_err(|error| in_rules(path, &file, error))?;
            return Ok(without_log(checked));
        }
        FileKind::Project => ProjectFile::parse(path, text.into())?.check()?,
        FileKind::Operator => teachtree_world::Operator::read(text, &name).map(drop)?,
        FileKind::Robot => {
            let robot = robot(&name, text, true)?;
            let massless = massless(&robot).map_or_else(String::new, |text| format!("\n  warning: {text}"));
            return Ok(pieces(&robot) + &jerks(&robot) + &oddities(&robot) + &massless);
        }
        // Of no YAML file.
        FileKind::Log | FileKind::Rules => {}
    }
    Ok(String::new())
}

/// An error about a binding and rules, at the line of the binding that names what the rules lack.
fn in_rules(path: &Path, file: &BindingFile, error: Error) -> InputError {
    if error.kind() != ErrorKind::Rules {
        return error.into_input();
    }
    let error = error.into_input();
    let is_named = |name: &&String| error.message.contains(&format!("`{name}`"));
    let param = file.binding.params.keys().find(is_named).map(|name| file.place(&["params", name]));
    let hand_file = file.binding.hand_file.iter().find(is_named).map(|_| file.place(&["hand_file"]));
    let place = param.or(hand_file).unwrap_or_else(|| path.display().to_string());
    let error = InputError { place, ..error };
    if error.help.is_some() {
        return error;
    }
    let own = format!("if it is for rules of your own, name them too: `teachtree check my.rules {}`", path.display());
    error.help(own)
}

/// What of a binding could not be checked.
fn without_log(checked: BindingCheck) -> String {
    match checked {
        BindingCheck::Whole => String::new(),
        BindingCheck::Form => "\n  `analyze LOG` checks its bodies and rules".into(),
    }
}

/// The bodies that a scene places wrongly, with their lines.
fn misplaced(scene: &Scene, text: &str, name: &str) -> String {
    let found = stream::misplacements(scene.inner()).into_iter();
    let warnings = found.map(|stream::Misplacement { body, message }| {
        let place = yaml::place(text, name, &["bodies", &body, "position"]);
        format!("\n  warning: {place}: {message}")
    });
    warnings.collect()
}

/// How many convex pieces the meshes of a robot became.
fn pieces(robot: &Robot) -> String {
    let rounded = |shape: &CollisionShape| match shape {
        CollisionShape::Piece(_, polytope) => Some(polytope.radius),
        _ => None,
    };
    let of = |link: &Link| link.solids.iter().filter_map(rounded).collect::<Vec<f64>>();
    let links: Vec<Vec<f64>> = robot.tree.links.iter().map(of).filter(|pieces| !pieces.is_empty()).collect();
    if links.is_empty() {
        return String::new();
    }
    let count = links.iter().map(Vec::len).sum::<usize>();
    let most = links.concat().into_iter().fold(0.0, f64::max) * 1e3;
    format!(" with meshes on {} links in {count} convex pieces, rounded by {most:.1} mm at most", links.len())
}

/// How many joints of a robot have a limit of jerk.
fn jerks(robot: &Robot) -> String {
    let dofs = &robot.tree.dofs;
    match dofs.iter().filter(|dof| dof.jerk.is_finite()).count() {
        0 => String::new(),
        limited => format!(", with limits of jerk on {limited} of {} joints", dofs.len()),
    }
}

/// Formats the parts of a URDF that are ignored or replaced, on links that no hand or arm needs.
fn oddities(robot: &Robot) -> String {
    let listed = robot.oddities.iter().take(ODDITIES).map(|Oddity { error, instead, .. }| {
        let instead = instead.unwrap_or("the joint is fixed");
        format!("\n  warning: {}: {}; {instead}, and no hand or arm of a hand needs it", error.place, error.message)
    });
    let more = match robot.oddities.len().saturating_sub(ODDITIES) {
        0 => String::new(),
        more => format!("\n  and {more} more such warnings"),
    };
    listed.collect::<String>() + &more
}

/// The warning that an arm has links without masses.
pub fn massless(robot: &Robot) -> Option<String> {
    let joints = robot.massless_arm();
    let (name, count) = (&robot.tree.dofs[*joints.first()?].name, joints.len());
    Some(format!(
        "no link that `{name}` moves has a mass (such joints of arms: {count}); `simulate` gives them the inertia of a motor that reaches its speed in 25 ms: their torques are not those of the robot"
    ))
}

/// Reads a text as a robot file, with its meshes or without them.
fn robot(name: &str, text: &str, meshes: bool) -> Result<Robot, InputError> {
    let text_of = |file: &str| match file == name {
        true => Ok(text.into()),
        false => text::read(Path::new(file), robot::MAX_BYTES),
    };
    let bytes_of = |file: &Path| text::bytes(file, robot::MAX_MESH_BYTES);
    if meshes { robot::open_with_meshes(name, &text_of, &bytes_of) } else { robot::open(name, &text_of) }
}

/// The text of a file.
///
/// # Errors
/// When it cannot be read.
pub fn text(path: &Path) -> Result<String, InputError> {
    text::read(path, yaml::MAX_BYTES as u64)
}

/// What is wrong with a text that an editor shows; nothing where it is of no kind that is known here.
pub fn wrong(path: &Path, text: &str) -> Option<InputError> {
    match FileKind::of(path, text)? {
        // An editor asks after each change: meshes would take too long.
        FileKind::Robot => robot(&path.display().to_string(), text, false).err(),
        kind => read(kind, path, text, None).err(),
    }
}
