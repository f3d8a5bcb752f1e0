//! Files in the place of files of another kind: one check for the arguments of all commands, before the command runs.

use clap::ArgMatches;
use std::cmp::Reverse;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::file_kind::FileKind;
use teachtree_base::yaml;
use teachtree_logs::read::text;

/// The files that an argument takes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ArgumentKind {
    /// Files of this kind.
    Kind(FileKind),
    /// The commands of a robot, JSON.
    Commands,
    /// A file of labels, which may be a table.
    Labels,
}

/// The arguments that take files of one kind, by their names in the command line.
const ARGUMENTS: [(&str, ArgumentKind); 12] = [
    ("log", ArgumentKind::Kind(FileKind::Log)),
    ("logs", ArgumentKind::Kind(FileKind::Log)),
    ("source", ArgumentKind::Kind(FileKind::Log)),
    ("data", ArgumentKind::Kind(FileKind::Log)),
    ("bags", ArgumentKind::Kind(FileKind::Log)),
    ("binding", ArgumentKind::Kind(FileKind::Binding)),
    ("scene", ArgumentKind::Kind(FileKind::Scene)),
    ("robot", ArgumentKind::Kind(FileKind::Robot)),
    ("rules", ArgumentKind::Kind(FileKind::Rules)),
    ("hand", ArgumentKind::Kind(FileKind::Rules)),
    ("commands", ArgumentKind::Commands),
    ("labels", ArgumentKind::Labels),
];

/// A file that is given for an argument.
struct GivenFile {
    /// `LOG` or `--binding`.
    argument: String,
    is_positional: bool,
    expected: ArgumentKind,
    path: PathBuf,
    text: String,
    found: FileKind,
}

/// Checks the files that a command line names.
///
/// # Errors
/// The first file of another kind than its argument takes; names of a robot and a scene that are swapped.
pub fn check(command: &clap::Command, matches: &ArgMatches) -> Result<(), InputError> {
    if let Some((name, of_subcommand)) = matches.subcommand()
        && let Some(subcommand) = command.find_subcommand(name)
    {
        check(subcommand, of_subcommand)?;
    }
    let given = given_files(command, matches);
    match given.iter().find(|file| !file.expected.takes(file.found)) {
        Some(wrong) => Err(wrong.error(&given)),
        None => check_names(matches),
    }
}

/// The files that exist and whose kind is known.
fn given_files(command: &clap::Command, matches: &ArgMatches) -> Vec<GivenFile> {
    let mut given = Vec::new();
    for argument in command.get_arguments() {
        let id = argument.get_id().as_str();
        // `teach` names the scene and the operator without options, and reports an exchange of them itself.
        let is_of_teach = id == "scene" && argument.is_positional();
        let Some((_, expected)) = ARGUMENTS.iter().find(|(known, _)| *known == id && !is_of_teach) else { continue };
        let Ok(Some(values)) = matches.try_get_raw(id) else { continue };
        let name = match (argument.get_long(), argument.get_value_names()) {
            (Some(long), _) => format!("--{long}"),
            (None, Some([name, ..])) => name.to_string(),
            _ => id.to_uppercase(),
        };
        given.extend(values.filter_map(|value| {
            let path = PathBuf::from(value);
            let (found, text) = kind(&path)?;
            let (argument, is_positional) = (name.clone(), argument.is_positional());
            Some(GivenFile { argument, is_positional, expected: *expected, path, text, found })
        }));
    }
    given
}

/// The kind of a file and, of a YAML file, its text; `None` for a folder, a pipe or the name of a shipped file.
fn kind(path: &Path) -> Option<(FileKind, String)> {
    if !path.is_file() {
        return None;
    }
    let text = match yaml::is_yaml(path) {
        true => text::read(path, yaml::MAX_BYTES as u64).ok()?,
        false => String::new(),
    };
    Some((FileKind::of(path, &text)?, text))
}

impl ArgumentKind {
    fn takes(self, found: FileKind) -> bool {
        match self {
            Self::Kind(kind) => kind == found,
            Self::Commands => false,
            Self::Labels => found == FileKind::Log,
        }
    }
}

impl GivenFile {
    /// The error about a file of another kind; another argument of `given` may have the file that belongs here.
    fn error(&self, given: &[Self]) -> InputError {
        let path = self.path.display();
        let error = match self.expected {
            ArgumentKind::Kind(kind) => kind.misplaced(&self.path, &self.text),
            ArgumentKind::Commands | ArgumentKind::Labels => None,
        };
        let found = self.found.name();
        let error = error.unwrap_or_else(|| match self.expected {
            ArgumentKind::Labels => InputError::new("", format!("found {found}, expected a file of labels")),
            _ if self.found == FileKind::Log => InputError::new("", format!("found {found}, expected commands"))
                .help(format!("`teachtree retarget {path} -o commands.json` writes them")),
            _ => InputError::new("", format!("found {found}, expected commands"))
                .help("commands are the JSON file that `teachtree retarget` writes"),
        });
        let place = if self.is_positional { path.to_string() } else { format!("{} {path}", self.argument) };
        let error = InputError { place, ..error };
        let is_swapped =
            |other: &&Self| other.expected == ArgumentKind::Kind(self.found) && self.expected.takes(other.found);
        match given.iter().find(is_swapped) {
            Some(other) => {
                let mut pair = [(self, other), (other, self)];
                pair.sort_by_key(|(argument, _)| Reverse(argument.is_positional));
                let [first, second] = pair.map(|(argument, file)| argument.with(&file.path));
                let [one, two] = pair.map(|(argument, _)| &argument.argument);
                error.help(format!("{one} and {two} are swapped: `{first} {second}`"))
            }
            None => error,
        }
    }

    /// The argument with another file, as on the command line.
    fn with(&self, path: &Path) -> String {
        let path = path.display();
        if self.is_positional { path.to_string() } else { format!("{} {path}", self.argument) }
    }
}

/// Checks the names of a shipped robot and a shipped scene.
fn check_names(matches: &ArgMatches) -> Result<(), InputError> {
    let name = |id: &str| matches.try_get_raw(id).ok().flatten()?.next()?.to_str();
    let (Some(robot), Some(scene)) = (name("robot"), name("scene")) else { return Ok(()) };
    let is_scene = |name: &str| teachtree_world::shipped::scenes().any(|(known, _)| known == name);
    if is_scene(robot) && !is_scene(scene) && teachtree_robot::texts().any(|(known, _)| known == scene) {
        let error = InputError::new(format!("--robot {robot}"), "found a scene, expected a robot");
        return Err(error.help(format!("--robot and --scene are swapped: `--robot {scene} --scene {robot}`")));
    }
    Ok(())
}
