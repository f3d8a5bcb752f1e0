//! `teachtree list` and `teachtree show`: the files that are in the program.

use super::output_args::FormatArg;
use super::{Failure, output};
use serde_json::{Value, json};
use std::fmt::Write;
use teachtree_analysis::json::{VERSION, printed as printed_json};
use teachtree_base::error::InputError;
use teachtree_base::spelling::nearest;
use teachtree_frames::bind::arm_models;
use teachtree_frames::hand_models;
use teachtree_language::{SHIPPED, shipped};
use teachtree_report::words;

macro_rules! bindings {
    ($($folder:literal / $name:literal),+ $(,)?) => {
        /// Name and text of the bindings of the demos.
        const BINDINGS: &[(&str, &str)] = &[$((
            concat!($name, ".binding.yaml"),
            include_str!(concat!("../../demos/", $folder, "/", $name, ".binding.yaml")),
        )),+];
    };
}

bindings![
    "bindings" / "dapg_door",
    "bindings" / "desk_yumi",
    "bindings" / "dfki_hand",
    "bindings" / "hiro_snap",
    "bindings" / "icsc_peeling",
    "bindings" / "icsc_wiping",
    "bindings" / "myodm",
    "bindings" / "robot_failures",
    "bindings" / "task_board",
    "robosuite" / "baxter_lift",
    "robosuite" / "baxter_peg_in_hole",
    "robosuite" / "door",
    "robosuite" / "handover",
    "robosuite" / "lift_hdf5",
    "robosuite" / "panda_lift",
    "robosuite" / "panda_nut_assembly",
    "robosuite" / "panda_stack",
    "robosuite" / "sawyer_lift",
    "robosuite" / "sawyer_nut_assembly",
    "robosuite" / "sawyer_pick_place",
    "robosuite" / "sawyer_stack",
    "robosuite" / "wipe",
];

/// Name and text of the schemas of YAML files.
const SCHEMAS: &[(&str, &str)] = &[
    ("binding.schema.json", include_str!("../../schemas/binding.schema.json")),
    ("operator.schema.json", include_str!("../../schemas/operator.schema.json")),
    ("project.schema.json", include_str!("../../schemas/project.schema.json")),
    ("robot.schema.json", include_str!("../../schemas/robot.schema.json")),
    ("scene.schema.json", include_str!("../../schemas/scene.schema.json")),
    ("variation.schema.json", include_str!("../../schemas/variation.schema.json")),
];

/// How a YAML file names its schema to an editor, from its own folder.
const SCHEMA_OF_A_FILE: &str = "# yaml-language-server: $schema=";

/// Options of `list`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree list\n  teachtree list bindings\n  teachtree show contact.rules > my.rules"
)]
pub struct ListArgs {
    /// The files of one kind
    #[arg(value_enum)]
    kind: Option<Kind>,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// A line for each file
    Text,
    /// `teachtree.list/1`
    Json,
}

/// Options of `show`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree show contact.rules > my.rules\n  teachtree show pick_and_place.operator.yaml\n  teachtree show sawyer_stack.binding.yaml"
)]
pub struct ShowArgs {
    /// A file of `teachtree list`; the extension is optional if the name is unique
    name: String,
}

/// Kinds of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    /// What --rules and --hand take by name
    Rules,
    /// What --scene takes, and `teach` by name
    Scenes,
    /// Who demonstrates: what `teach` takes by name
    Operators,
    /// What --robot takes by name
    Robots,
    /// Bindings of recordings that other people made
    Bindings,
    /// Arms whose joints a binding names by `model`
    Arms,
    /// The words that `annotate --words` takes, and the choice of hand models
    Tables,
    /// JSON Schemas of YAML files, for editors
    Schemas,
}

impl Kind {
    const ALL: [Self; 8] = [
        Self::Rules,
        Self::Scenes,
        Self::Operators,
        Self::Robots,
        Self::Bindings,
        Self::Arms,
        Self::Tables,
        Self::Schemas,
    ];

    const fn name(self) -> &'static str {
        match self {
            Self::Rules => "rules",
            Self::Scenes => "scenes",
            Self::Operators => "operators",
            Self::Robots => "robots",
            Self::Bindings => "bindings",
            Self::Arms => "arms",
            Self::Tables => "tables",
            Self::Schemas => "schemas",
        }
    }

    /// The files of the kind, with their texts.
    fn files(self) -> Vec<(String, &'static str)> {
        let named =
            |files: &[(&str, &'static str)]| files.iter().map(|(name, text)| ((*name).to_string(), *text)).collect();
        match self {
            Self::Rules => named(SHIPPED),
            Self::Bindings => named(BINDINGS),
            Self::Arms => named(&arm_models::URDFS),
            Self::Tables => named(&[words::SHIPPED, hand_models::SHIPPED]),
            Self::Schemas => named(SCHEMAS),
            Self::Scenes => {
                teachtree_world::shipped::scenes().map(|(name, scene)| (format!("{name}.yaml"), scene)).collect()
            }
            Self::Operators => {
                let texts = teachtree_world::shipped::operators();
                texts.map(|(name, operator)| (format!("{name}.operator.yaml"), operator)).collect()
            }
            Self::Robots => teachtree_robot::texts().map(|(name, text)| (format!("{name}.yaml"), text)).collect(),
        }
    }
}

/// The description in a file: the first sentence of its first comment, or its key `about` or `name`.
fn about(text: &str) -> String {
    let is_for_programs = |line: &str| line.starts_with(SCHEMA_OF_A_FILE) || line.starts_with("<?xml");
    let mut lines = text.lines().skip_while(|line| line.trim().is_empty() || is_for_programs(line));
    let Some(first) = lines.next() else { return String::new() };
    if first == "{" {
        let title = text.lines().find_map(|line| line.strip_prefix("  \"description\": \"")).unwrap_or_default();
        return title.trim_end_matches("\",").to_string();
    }
    let Some(start) = ["///", "//", "#", "<!--"].into_iter().find(|start| first.starts_with(start)) else {
        let value = |line: &str| ["about:", "name:"].iter().find_map(|key| line.strip_prefix(key)).map(str::to_string);
        let found = std::iter::once(first).chain(lines).find_map(value).unwrap_or_default();
        return found.trim().trim_matches('"').to_string();
    };
    let comment = std::iter::once(first).chain(lines).map_while(|line| line.strip_prefix(start)).map(str::trim);
    let comment = comment.collect::<Vec<&str>>().join(" ");
    let end = comment.find(". ").map_or(comment.len(), |at| at + 1);
    comment.get(..end).unwrap_or_default().trim().to_string()
}

/// Lists the files.
pub fn list(args: &ListArgs) -> Result<(), Failure> {
    let kinds: Vec<Kind> =
        Kind::ALL.into_iter().filter(|kind| args.kind.is_none_or(|wanted| wanted == *kind)).collect();
    Ok(args.form.print(&match args.form.format {
        Format::Text => text(&kinds),
        Format::Json => printed_json(&document(&kinds)),
    })?)
}

/// The files for people, under the names of their kinds where there are several.
fn text(kinds: &[Kind]) -> String {
    let mut text = String::new();
    for kind in kinds {
        let files = kind.files();
        let indent = if kinds.len() > 1 { "  " } else { "" };
        if kinds.len() > 1 {
            let _ = writeln!(text, "{}{}", if text.is_empty() { "" } else { "\n" }, kind.name());
        }
        let width = files.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        for (name, file) in files {
            let _ = writeln!(text, "{}", format!("{indent}{name:<width$}  {}", about(file)).trim_end());
        }
    }
    text
}

/// The files as `teachtree.list/1` (docs/formats.md).
fn document(kinds: &[Kind]) -> Value {
    let of = |kind: &Kind| {
        let files = kind.files().into_iter();
        let name_of_kind = kind.name();
        files.map(move |(name, text)| json!({"kind": name_of_kind, "name": name, "about": about(text)}))
    };
    json!({"schema": "teachtree.list/1", "version": VERSION, "files": kinds.iter().flat_map(of).collect::<Vec<_>>()})
}

/// The text of a file outside the repository: its schema, which `show` prints too, stands beside it.
fn printed(text: &str) -> String {
    match text.strip_prefix(SCHEMA_OF_A_FILE).and_then(|rest| rest.split_once('\n')) {
        Some((schema, rest)) => format!("{SCHEMA_OF_A_FILE}{}\n{rest}", schema.rsplit('/').next().unwrap_or(schema)),
        None => text.to_string(),
    }
}

/// Prints a file.
pub fn show(args: &ShowArgs) -> Result<(), Failure> {
    let all: Vec<(String, &str)> = Kind::ALL.into_iter().flat_map(Kind::files).collect();
    let stem = |name: &str| name.split('.').next().unwrap_or_default().to_string();
    let wanted = shipped(&args.name).map_or(args.name.as_str(), |(name, _)| name);
    let exact: Vec<_> = all.iter().filter(|(name, _)| *name == wanted).collect();
    let found = if exact.is_empty() { all.iter().filter(|(name, _)| stem(name) == args.name).collect() } else { exact };
    match found.as_slice() {
        [(_, text)] => Ok(output::print_data(&printed(text))?),
        [] => {
            let error = InputError::new(&args.name, "no file of this name is in the program");
            let names = all.iter().map(|(name, _)| name.as_str());
            Err(match nearest(&args.name, names) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error.help("`teachtree list` lists them"),
            }
            .into())
        }
        several => {
            let names: Vec<String> = several.iter().map(|(name, _)| format!("`{name}`")).collect();
            let message = format!("found {} files of this name, expected one", several.len());
            Err(InputError::new(&args.name, message).help(format!("name one of {}", names.join(", "))).into())
        }
    }
}
