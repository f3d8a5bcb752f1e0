//! Segments and tasks in words, as instructions to people and policies: `insert the plug into the socket`, `left hand: hold the plate; right hand: wipe
//! the plate`.
//!
//! The words of the shipped rules are a table, `rules/words.yaml`, which a table of the user replaces line by line. A template has the placeholders `{name}`, `{object}`, `{partner}` and `{hand}`; what stands in brackets is left out where a placeholder in it has nothing
//! to stand for. Names of primitives and tasks are put in words: `peg_in_hole` as `peg in hole`, `MainGrasp(left)` as `main grasp (left)`.

mod names;

pub use names::ParsedPhrase;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use teachtree_analysis::{Analysis, Subject, Track, TrackId, UNKNOWN};
use teachtree_base::error::InputError;
use teachtree_base::yaml;

/// Name and text of the words of the shipped rules.
pub const SHIPPED: (&str, &str) = ("words.yaml", include_str!("../../../rules/words.yaml"));

/// The template of names without words.
const TEMPLATE: &str = "{name}[ {object}][ ({partner})]";
/// That of what no task of the rules describes.
const UNKNOWN_TASK: &str = "handle[ {object}]";
/// The longest template, bytes.
const LONGEST: usize = 1000;
/// Stands for both hands in words.
const BOTH: &str = "both hands";

/// What of an analysis is put in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Style {
    /// The primitives.
    Motion,
    /// The tasks.
    Subtask,
}

impl Style {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Motion, Self::Subtask];

    /// The name that LeRobot gives it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motion => "motion",
            Self::Subtask => "subtask",
        }
    }
}

/// Words that hold from a row of the log on, counted from 0, until the next ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Words {
    /// The row.
    pub row: usize,
    /// The row after the last one of what they name, at most that of the next words.
    pub end: usize,
    /// The words.
    pub content: String,
}

/// How names become words.
///
/// Without words, as by default, each name is worded as `name object (partner)`.
#[derive(Clone, Debug, Default)]
pub struct Phrasing {
    /// Words of names and bodies, which all other templates replace.
    table: BTreeMap<String, Template>,
    /// For all names.
    general: Option<Template>,
    /// For one name: of a primitive, a task, a body, or a style, which stands for all its names.
    special: BTreeMap<String, Template>,
    /// The names that a table of the user adds to the shipped ones, each with its line.
    added: BTreeMap<String, String>,
}

impl Phrasing {
    /// Reads templates: `TEMPLATE` for all names, or `NAME=TEMPLATE` for one.
    ///
    /// # Errors
    /// A template that is wrong, or one given twice.
    pub fn read(texts: &[String]) -> Result<Self, InputError> {
        let mut phrasing = Self::default();
        for text in texts {
            let wrong = |message: String| InputError::new("--words", format!("`{text}`: {message}"));
            let named = text.split_once('=').filter(|(name, _)| is_name(name));
            let template = Template::read(named.map_or(text.as_str(), |(_, template)| template)).map_err(wrong)?;
            let taken = match named {
                Some((name, _)) => phrasing.special.insert(name.into(), template).is_some(),
                None if !template.names() => {
                    return Err(wrong("expected `{name}` in a template for all names".into())
                        .help("`NAME=TEMPLATE` is for one primitive, task or body"));
                }
                None => phrasing.general.replace(template).is_some(),
            };
            if taken {
                return Err(wrong("is a second template for the same names".into()));
            }
        }
        Ok(phrasing)
    }

    /// The words of the shipped rules.
    ///
    /// # Errors
    /// As [`with_table`](Self::with_table); never, unless the shipped table is wrong.
    pub fn shipped() -> Result<Self, InputError> {
        Ok(Self { added: BTreeMap::new(), ..Self::default().with_table(SHIPPED.1, SHIPPED.0)? })
    }

    /// The same with the lines of a table in YAML, `NAME: TEMPLATE`, in the place of those of the same names; `file` is its name in messages.
    ///
    /// # Errors
    /// A text that is not such a table, or a template that is wrong, at its line.
    pub fn with_table(mut self, text: &str, file: &str) -> Result<Self, InputError> {
        let lines: BTreeMap<String, String> = yaml::read(text, file)?;
        for (name, words) in lines {
            let place = yaml::place(text, file, &[&name]);
            let wrong = |message: String| InputError::new(&place, format!("{name}: {message}"));
            let template = Template::read(&words).map_err(wrong)?;
            if self.table.insert(name.clone(), template).is_none() {
                self.added.insert(name, place);
            }
        }
        Ok(self)
    }

    /// The same with templates in the place of those of the table, as [`read`](Self::read) reads them.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn with_templates(self, texts: &[String]) -> Result<Self, InputError> {
        Ok(Self { table: self.table, added: self.added, ..Self::read(texts)? })
    }

    /// All templates that count, as [`read`](Self::read) reads them: words are read back by them, whatever the table of a later version says.
    pub fn texts(&self) -> Vec<String> {
        let special = self.special.iter().map(|(name, template)| format!("{name}={template}"));
        let counts = |name: &str| {
            let style = if name.starts_with(char::is_uppercase) { Style::Motion } else { Style::Subtask };
            self.general.is_none() && !self.special.contains_key(style.name()) && !self.special.contains_key(name)
        };
        let table = self.table.iter().filter(|(name, _)| counts(name));
        let table = table.map(|(name, template)| format!("{name}={template}"));
        self.general.iter().map(Template::to_string).chain(special).chain(table).collect()
    }

    /// Whether names have no words.
    fn is_plain(&self) -> bool {
        self.table.is_empty() && self.special.is_empty() && self.general.is_none()
    }

    /// The first name that the user gives words, and that is neither known nor in the shipped table, with its place: a line of a table or `--words`.
    pub fn unknown<'a>(&'a self, known: &BTreeSet<String>) -> Option<(&'a str, &'a str)> {
        let is_style = |name: &str| name == UNKNOWN || Style::ALL.iter().any(|style| style.name() == name);
        let added = self.added.iter().map(|(name, place)| (name.as_str(), place.as_str()));
        let special = self.special.keys().map(|name| (name.as_str(), "--words")).filter(|(name, _)| !is_style(name));
        added.chain(special).find(|(name, _)| !known.contains(*name))
    }

    /// The words of a name, and whether they name the hand.
    fn words(&self, style: Style, name: &str, subject: &Subject, hand: &str) -> (String, bool) {
        let template = self.template(style, name);
        let body = |name: &Option<String>| -> String {
            let name = name.as_deref().unwrap_or_default();
            let of_body = self.special.get(name).or_else(|| self.table.get(name)).filter(|_| !name.is_empty());
            // In the shipped words, which are sentences, names of bodies are words too: `right_cube`.
            let plain = || if self.table.is_empty() { name.to_string() } else { name.replace('_', " ") };
            of_body.map_or_else(plain, |template| template.fill(&|_| String::new()))
        };
        let text = template.fill(&|placeholder| match placeholder {
            Placeholder::Name => in_words(name),
            Placeholder::Object => body(&subject.object),
            Placeholder::Partner => body(&subject.partner),
            Placeholder::Hand => hand.to_string(),
        });
        (text.split_whitespace().collect::<Vec<_>>().join(" "), template.has(Placeholder::Hand))
    }

    /// The template of a name: its own, that of its style or of all names, that of the table, or the plain one.
    fn template(&self, style: Style, name: &str) -> Template {
        let base = name.split('(').next().unwrap_or(name);
        let own = |of: &BTreeMap<String, Template>| of.get(name).or_else(|| of.get(base)).cloned();
        let usual = || self.special.get(style.name()).or(self.general.as_ref()).cloned();
        let plain = || Template::of(if name == UNKNOWN { UNKNOWN_TASK } else { TEMPLATE });
        own(&self.special).or_else(usual).or_else(|| own(&self.table)).unwrap_or_else(plain)
    }

    /// The words of an analysis in order of time: of one hand, or of both hands together wherever one of them changes what it does. Words that do not
    /// change are written once.
    pub fn of(&self, analysis: &Analysis, style: Style) -> Vec<Words> {
        let hands: Vec<(&'static str, Vec<Span>)> =
            analysis.tracks.iter().filter_map(|track| spans(track, style)).collect();
        let mut starts: Vec<usize> = hands.iter().flat_map(|(_, spans)| spans.iter().map(|span| span.row)).collect();
        starts.sort_unstable();
        starts.dedup();
        let mut all: Vec<Words> = Vec::new();
        for row in starts {
            let current = hands.iter().filter_map(|(hand, spans)| {
                let at = spans.partition_point(|span| span.row <= row).checked_sub(1)?;
                Some((*hand, spans.get(at)?))
            });
            let current: Vec<(&str, &Span)> = current.collect();
            let content = match current.as_slice() {
                [(_, one), (_, other)] if one.reads_as(other) => vec![self.phrase(style, one, BOTH, true)],
                several => several.iter().map(|(hand, span)| self.phrase(style, span, hand, hands.len() > 1)).collect(),
            };
            let content = content.join("; ");
            let end = current.iter().map(|(_, span)| span.end).max().unwrap_or(row);
            match all.last_mut() {
                Some(last) if last.content == content => last.end = last.end.max(end),
                _ => {
                    if let Some(last) = all.last_mut() {
                        last.end = last.end.min(row);
                    }
                    all.push(Words { row, end, content });
                }
            }
        }
        all
    }

    fn phrase(&self, style: Style, span: &Span, hand: &str, of_two: bool) -> String {
        let (words, names_hand) = self.words(style, span.name, span.subject, hand);
        if of_two && !names_hand { format!("{hand}: {words}") } else { words }
    }
}

/// A name that holds from a row on.
struct Span<'a> {
    row: usize,
    end: usize,
    name: &'a str,
    subject: &'a Subject,
}

impl Span<'_> {
    fn reads_as(&self, other: &Self) -> bool {
        (self.name, self.subject) == (other.name, other.subject)
    }
}

/// What a hand does; the coordination of both is in what each of them does.
fn spans(track: &Track, style: Style) -> Option<(&'static str, Vec<Span<'_>>)> {
    let hand = match track.who {
        TrackId::Hand(teachtree_base::hands::Side::Left) => "left hand",
        TrackId::Hand(teachtree_base::hands::Side::Right) => "right hand",
        TrackId::Both => return None,
    };
    let spans = match style {
        Style::Motion => track
            .relabeled
            .iter()
            .map(|segment| Span {
                row: segment.rows.start,
                end: segment.rows.end,
                name: &segment.primitive,
                subject: &segment.subject,
            })
            .collect(),
        Style::Subtask => track
            .tasks
            .iter()
            .map(|task| Span { row: task.rows.start, end: task.rows.end, name: &task.task, subject: &task.subject })
            .collect(),
    };
    Some((hand, spans))
}

fn is_name(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '(' | ')'))
}

/// A name in words: `pick_and_place` and `PickAndPlace` are `pick and place`.
fn in_words(name: &str) -> String {
    let mut words = String::new();
    let mut before_is_lower = false;
    for letter in name.chars() {
        match letter {
            '_' => words.push(' '),
            '(' => words.push_str(" ("),
            letter => {
                if letter.is_uppercase() && before_is_lower {
                    words.push(' ');
                }
                words.extend(letter.to_lowercase());
            }
        }
        before_is_lower = letter.is_lowercase() || letter.is_numeric();
    }
    words
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Placeholder {
    Name,
    Object,
    Partner,
    Hand,
}

impl Placeholder {
    const ALL: [(&'static str, Self); 4] =
        [("name", Self::Name), ("object", Self::Object), ("partner", Self::Partner), ("hand", Self::Hand)];
}

/// Text with placeholders.
#[derive(Clone, Debug, PartialEq)]
struct Template(Vec<TemplatePart>);

#[derive(Clone, Debug, PartialEq)]
enum TemplatePart {
    Text(String),
    Placeholder(Placeholder),
    /// Left out where a placeholder in it is empty.
    Optional(Template),
}

impl fmt::Display for Template {
    /// As it is read.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|part| match part {
            TemplatePart::Text(text) => f.write_str(text),
            TemplatePart::Placeholder(placeholder) => {
                let name = Placeholder::ALL.iter().find(|(_, known)| known == placeholder).map_or("", |(name, _)| name);
                write!(f, "{{{name}}}")
            }
            TemplatePart::Optional(inner) => write!(f, "[{inner}]"),
        })
    }
}

impl Template {
    /// A template that is known to be right.
    fn of(text: &str) -> Self {
        Self::read(text).unwrap_or_else(|_| Self(vec![TemplatePart::Placeholder(Placeholder::Name)]))
    }

    fn read(text: &str) -> Result<Self, String> {
        if text.len() > LONGEST {
            return Err(format!("is longer than {LONGEST} bytes"));
        }
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some(at) = rest.find(['{', '}', '[', ']']) {
            let (head, tail) = rest.split_at(at);
            if !head.is_empty() {
                parts.push(TemplatePart::Text(head.into()));
            }
            let (open, tail) = tail.split_at(1);
            let close = match open {
                "{" => '}',
                "[" => ']',
                other => return Err(format!("found `{other}` that closes nothing")),
            };
            let (inner, after) = tail.split_once(close).ok_or_else(|| format!("expected `{close}` after `{open}`"))?;
            if open == "[" && inner.contains('[') {
                return Err("found `[` in brackets, expected text and placeholders".into());
            }
            parts.push(if open == "[" {
                TemplatePart::Optional(Self::read(inner)?)
            } else {
                let known = Placeholder::ALL.iter().find(|(name, _)| *name == inner);
                let (_, placeholder) = known.ok_or_else(|| {
                    format!("found `{{{inner}}}`, expected `{{name}}`, `{{object}}`, `{{partner}}` or `{{hand}}`")
                })?;
                TemplatePart::Placeholder(*placeholder)
            });
            rest = after;
        }
        if !rest.is_empty() {
            parts.push(TemplatePart::Text(rest.into()));
        }
        if parts.is_empty() { Err("expected words, found nothing".into()) } else { Ok(Self(parts)) }
    }

    fn has(&self, wanted: Placeholder) -> bool {
        self.0.iter().any(|part| match part {
            TemplatePart::Text(_) => false,
            TemplatePart::Placeholder(placeholder) => *placeholder == wanted,
            TemplatePart::Optional(inner) => inner.has(wanted),
        })
    }

    fn names(&self) -> bool {
        self.has(Placeholder::Name)
    }

    fn fill(&self, of: &dyn Fn(Placeholder) -> String) -> String {
        let mut text = String::new();
        for part in &self.0 {
            match part {
                TemplatePart::Text(plain) => text.push_str(plain),
                TemplatePart::Placeholder(placeholder) => text.push_str(&of(*placeholder)),
                TemplatePart::Optional(inner) => {
                    let empty = Placeholder::ALL.iter().any(|(_, it)| inner.has(*it) && of(*it).is_empty());
                    if !empty {
                        text.push_str(&inner.fill(of));
                    }
                }
            }
        }
        text
    }
}
