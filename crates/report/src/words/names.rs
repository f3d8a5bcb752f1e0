//! Words back to names: which primitive or task a text is about that a template may have been filled to, or that a person has written so.

use super::{Phrasing, Placeholder, Style, Template, TemplatePart, in_words};
use teachtree_analysis::UNKNOWN;
use teachtree_base::hands::{Side, TrackId};

/// The most ways in which brackets are there or not that are looked through.
const MAX_WAYS: usize = 64;
/// The longest text, bytes.
const LONGEST: usize = 400;
/// Stands for any text in a pattern.
const ANY: char = '\u{0}';
/// The hands by their words.
const HANDS: [(&str, TrackId); 3] = [
    ("left hand", TrackId::Hand(Side::Left)),
    ("right hand", TrackId::Hand(Side::Right)),
    (super::BOTH, TrackId::Both),
];

/// The track and the name that a part of a text is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParsedPhrase {
    /// Whom it names; `Both` where it says that both hands do it.
    pub hand: Option<TrackId>,
    /// The name; `None` where the text fits none, or several.
    pub name: Option<String>,
}

impl Phrasing {
    /// What each part of a text is about, one a hand.
    pub fn names(&self, text: &str, style: Style, known: &[String]) -> Vec<ParsedPhrase> {
        text.split("; ").map(|part| self.named(part, style, known)).collect()
    }

    fn named(&self, text: &str, style: Style, known: &[String]) -> ParsedPhrase {
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let named_hand =
            HANDS.iter().find_map(|(words, who)| Some((*who, text.strip_prefix(words)?.strip_prefix(": ")?)));
        let (hand, rest) = named_hand.map_or((None, text.as_str()), |(who, rest)| (Some(who), rest));
        if rest.len() > LONGEST {
            return ParsedPhrase { hand, name: None };
        }
        if known.iter().any(|name| name == rest) {
            return ParsedPhrase { hand, name: Some(rest.into()) };
        }
        // The pattern with the longest literal text wins: `move along` is not `move` with the object `along`.
        let mut best: Option<(usize, Option<String>, Option<TrackId>)> = None;
        let unknown = (style == Style::Subtask).then(|| UNKNOWN.to_string());
        for name in known.iter().chain(&unknown) {
            let template = self.template(style, name);
            for (words, who) in HANDS
                .iter()
                .filter(|_| template.has(Placeholder::Hand))
                .map(|(words, who)| (*words, Some(*who)))
                .chain([("", None)])
            {
                for pattern in ways(&template, name, words) {
                    let own = pattern.chars().filter(|letter| *letter != ANY).count();
                    let is_better = best.as_ref().is_none_or(|(best, ..)| own > *best);
                    let is_rival =
                        best.as_ref().is_some_and(|(best, other, _)| own == *best && other.as_ref() != Some(name));
                    if (is_better || is_rival) && fits(&pattern, rest) {
                        let name = Some(name.clone()).filter(|_| is_better);
                        best = Some((own, name, who));
                    }
                }
            }
        }
        let (name, who) = best.map_or((None, None), |(_, name, who)| (name, who));
        // Plain words, `peg in hole plug (socket)`, may stand beside others.
        if name.is_none() && !self.is_plain() {
            return Self::default().named(&text, style, known);
        }
        ParsedPhrase { hand: hand.or(who), name }
    }
}

/// The texts that a template may be filled to, with what stands in brackets and without.
fn ways(template: &Template, name: &str, hand: &str) -> Vec<String> {
    let words = |way: &String| way.split_whitespace().collect::<Vec<_>>().join(" ");
    filled(template, name, hand).iter().map(words).collect()
}

/// The same before blanks are joined.
fn filled(template: &Template, name: &str, hand: &str) -> Vec<String> {
    let mut ways = vec![String::new()];
    for part in &template.0 {
        let more: Vec<String> = match part {
            TemplatePart::Text(text) => vec![text.clone()],
            TemplatePart::Placeholder(Placeholder::Name) => vec![in_words(name)],
            TemplatePart::Placeholder(Placeholder::Hand) => vec![hand.to_string()],
            TemplatePart::Placeholder(Placeholder::Object | Placeholder::Partner) => vec![ANY.to_string()],
            TemplatePart::Optional(inner) => {
                let mut inner = filled(inner, name, hand);
                inner.push(String::new());
                inner
            }
        };
        ways = ways.iter().flat_map(|way| more.iter().map(move |more| format!("{way}{more}"))).take(MAX_WAYS).collect();
    }
    ways
}

/// Whether a text is the pattern with something in each place of [`ANY`].
fn fits(pattern: &str, text: &str) -> bool {
    let mut parts = pattern.split(ANY);
    let Some(mut rest) = parts.next().and_then(|head| text.strip_prefix(head)) else { return false };
    let mut parts = parts.peekable();
    if parts.peek().is_none() {
        return rest.is_empty();
    }
    while let Some(part) = parts.next() {
        if parts.peek().is_none() {
            return rest.len() > part.len() && rest.ends_with(part);
        }
        // Something stands before it.
        let after_one = rest.chars().next().map_or(0, char::len_utf8);
        let Some(at) = rest.get(after_one..).and_then(|later| later.find(part)) else { return false };
        rest = rest.get(after_one + at + part.len()..).unwrap_or_default();
    }
    true
}
