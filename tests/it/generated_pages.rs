//! Pages whose lower parts are generated: docs/reference/commands.md from `-h`, docs/reference/formats.md from the schemas of outputs.

use crate::program::{program, said};
use crate::schemas::schemas;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

/// The line above the generated part of a page.
const MARK: &str = "<!-- Generated below: TEACHTREE_WRITE_PAGES=1 cargo test --test it -- generated_pages:: -->\n";

/// Compares the generated part of a page with `generated`, or replaces it if `TEACHTREE_WRITE_PAGES` is set.
fn compare(page: &str, generated: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(page);
    let text = std::fs::read_to_string(&path).unwrap();
    let (prose, _) = text.split_once(MARK).unwrap_or_else(|| panic!("{page} lacks the line {MARK}"));
    let wanted = format!("{prose}{MARK}{generated}");
    if std::env::var_os("TEACHTREE_WRITE_PAGES").is_some() {
        std::fs::write(&path, wanted).unwrap();
    } else {
        assert!(text == wanted, "{page} is out of date; its line `Generated below` has the command that writes it");
    }
}

#[test]
#[cfg_attr(feature = "zenoh", ignore = "the page has the default features")]
fn the_page_of_commands_has_the_help_of_each() {
    let mut page = String::new();
    let names = help(&mut page, &[]);
    assert!(names.len() > 25, "{names:?}");
    for name in &names {
        for part in help(&mut page, &[name]) {
            help(&mut page, &[name, &part]);
        }
    }
    compare("docs/reference/commands.md", &page);
}

/// Writes the section of a command. Returns the names of its subcommands.
fn help(page: &mut String, command: &[&str]) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = program(root, &[command, &["-h"]].concat()).env("COLUMNS", "120").output().unwrap();
    assert!(output.status.success(), "{command:?}");
    let text = said(&output);
    // The first section has the options of all commands.
    let shown = |part: &&str| command.is_empty() || !part.starts_with("Options of all commands:");
    let is_option_of_all = |line: &str| line.starts_with("  -h, --help") || line.starts_with("  -V, --version");
    let parts: Vec<&str> = text.trim().split("\n\n").filter(shown).collect();
    let lines: Vec<String> = parts.join("\n\n").lines().map(|line| line.trim_end().to_string()).collect();
    let kept: Vec<&str> = lines.iter().map(String::as_str).filter(|line| !is_option_of_all(line)).collect();
    let title = if command.is_empty() { "teachtree".into() } else { command.join(" ") };
    let _ = write!(page, "\n## {title}\n\n```text\n{}\n```\n", kept.join("\n").trim());
    let options = kept.iter().position(|line| *line == "Options:").unwrap_or(kept.len());
    let list = if command.is_empty() { Some(0) } else { kept.iter().position(|line| *line == "Commands:") };
    let names =
        kept[list.unwrap_or(options)..options].iter().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    names.filter(|name| !name.is_empty() && *name != "help").map(str::to_string).collect()
}

#[test]
fn the_page_of_formats_has_the_fields_of_the_schemas() {
    let mut page = String::new();
    for (file, schema) in schemas() {
        let name = text(&schema, "title").trim_start_matches("teachtree.").replace('/', "-");
        assert_eq!(file, format!("{name}.schema.json"));
        let _ = write!(page, "\n## {}\n\n{}.\n\n", text(&schema, "title"), capitalized(text(&schema, "description")));
        Table { root: &schema, page: &mut page }.write(&schema);
        for (name, definition) in schema["$defs"].as_object().into_iter().flatten() {
            if has_fields(definition) {
                let about = text(definition, "description");
                let about = if about.is_empty() { String::new() } else { format!(": {about}") };
                let _ = write!(page, "\n**{}**{about}\n\n", name.replace('_', " "));
                Table { root: &schema, page: &mut page }.write(definition);
            }
        }
    }
    let empty: Vec<&str> = page.lines().filter(|line| line.ends_with("|  |")).collect();
    assert!(empty.is_empty(), "fields without a description:\n{}", empty.join("\n"));
    compare("docs/reference/formats.md", &page);
}

fn text<'a>(schema: &'a Value, key: &str) -> &'a str {
    schema[key].as_str().unwrap_or_default()
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().to_string() + letters.as_str())
}

/// Returns the alternatives of a schema.
fn branches(schema: &Value) -> impl Iterator<Item = &Value> {
    ["oneOf", "anyOf"].into_iter().filter_map(|key| schema[key].as_array()).flatten()
}

fn has_fields(schema: &Value) -> bool {
    schema["properties"].is_object() || branches(schema).any(has_fields)
}

/// A table of the fields of a schema.
struct Table<'a> {
    /// The schema with the definitions.
    root: &'a Value,
    page: &'a mut String,
}

impl Table<'_> {
    fn write(&mut self, schema: &Value) {
        self.page.push_str("| field | type | meaning |\n|---|---|---|\n");
        self.rows("", schema);
    }

    /// Writes a row for each field of an object, and for the fields of objects within it, whose names begin with `path`.
    fn rows(&mut self, path: &str, schema: &Value) {
        for branch in branches(schema) {
            self.rows(path, branch);
        }
        if schema["items"].is_object() {
            self.rows(&format!("{}[].", path.trim_end_matches('.')), &schema["items"]);
        }
        let required = schema["required"].as_array();
        for (name, field) in schema["properties"].as_object().into_iter().flatten() {
            let is_required = required.is_some_and(|required| required.iter().any(|one| one == name));
            let optional = if is_required { "" } else { ", optional" };
            let of_type = self.type_of(field);
            let meaning = self.meaning(schema, field).replace('|', "\\|");
            let _ = writeln!(self.page, "| `{path}{name}` | {of_type}{optional} | {meaning} |");
            self.rows(&format!("{path}{name}."), field);
        }
    }

    fn definition(&self, schema: &Value) -> Option<&Value> {
        Some(&self.root["$defs"][schema["$ref"].as_str()?.trim_start_matches("#/$defs/")])
    }

    /// Returns the description of a field, else that of its definition. A constant has that of the object that it distinguishes.
    fn meaning(&self, object: &Value, field: &Value) -> String {
        let own = text(field, "description");
        let other = if field["const"].is_string() { Some(object) } else { self.definition(field) };
        let other = other.map_or("", |other| text(other, "description"));
        if own.is_empty() { other } else { own }.to_string()
    }

    /// Returns the type of a value, such as `list of segment`.
    fn type_of(&self, schema: &Value) -> String {
        let joined = |mut names: Vec<String>| {
            names.dedup();
            names.join(" or ")
        };
        let name = text(schema, "type");
        if let Some(definition) = self.definition(schema) {
            let name = text(schema, "$ref").trim_start_matches("#/$defs/").replace('_', " ");
            return if has_fields(definition) { name } else { self.type_of(definition) };
        }
        if !schema["const"].is_null() {
            return format!("`{}`", schema["const"]);
        }
        if let Some(values) = schema["enum"].as_array() {
            let shown =
                |value: &Value| format!("`{}`", value.as_str().map_or_else(|| value.to_string(), str::to_string));
            return values.iter().map(shown).collect::<Vec<_>>().join(", ");
        }
        if branches(schema).next().is_some() {
            return joined(branches(schema).map(|branch| self.type_of(branch)).collect());
        }
        if let Some(types) = schema["type"].as_array() {
            return joined(types.iter().map(|name| name.as_str().unwrap_or_default().to_string()).collect());
        }
        if schema["items"].is_object() {
            let fixed = schema["maxItems"].as_u64().filter(|_| schema["minItems"] == schema["maxItems"]);
            let count = fixed.map_or_else(String::new, |count| format!("{count} "));
            return format!("list of {count}{}", self.type_of(&schema["items"]));
        }
        if schema["additionalProperties"].is_object() {
            return format!("object of {}", self.type_of(&schema["additionalProperties"]));
        }
        name.to_string()
    }
}
