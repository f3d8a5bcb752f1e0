//! A tree as rows in the order in which its author wrote them; for a frame, with how each choice came out.

use teachtree_base::hands::Side;
use teachtree_base::meaning::Primitives;
use teachtree_language::rules::{Branch, Consequent, Rules, Tree, TreeScope};

/// A tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outline {
    /// Its name and whom it labels, `single_hand for each hand`.
    pub title: String,
    /// The path on the requested frame, if any: `right at 2.500 s: Grasp`.
    pub frame: Option<String>,
    /// Its choices, each followed by those of its branch.
    pub rows: Vec<Row>,
    /// The primitives of the rules.
    pub primitives: Primitives,
}

/// A choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// The depth of its branch; 0 at the root.
    pub depth: usize,
    /// Its name, if it has one.
    pub name: Option<String>,
    /// The text of its condition; `else` for none.
    pub condition: String,
    /// The leaf; none when more choices follow.
    pub leaf: Option<String>,
    /// Where it stands.
    pub place: String,
    /// Whether it is the last one of its branch, which is taken whenever the others are not.
    pub is_last: bool,
    /// Its outcome.
    pub mark: Mark,
}

/// The outcome of a choice on the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Not evaluated, or no frame is shown.
    Quiet,
    /// Evaluated and not taken.
    Passed,
    /// Taken.
    Taken,
}

/// The path on a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TakenPath {
    /// The position of each choice in its branch, from the root to the leaf.
    pub path: Vec<usize>,
    /// Its caption.
    pub caption: String,
}

/// The rows of a tree.
pub fn outline(rules: &Rules, tree: &Tree, taken: Option<&TakenPath>) -> Outline {
    let whom = match tree.scope {
        TreeScope::EachHand => "for each hand".to_string(),
        TreeScope::BothHands => format!("for {}, {}", Side::Left, Side::Right),
    };
    let settle = tree.settle.as_ref().map_or(String::new(), |settle| {
        format!(", settle {} ms", teachtree_analysis::number::decimals(settle.value * 1e3, 3))
    });
    let mut rows = Vec::new();
    collect(rules, &tree.root, 0, taken.map(|taken| taken.path.as_slice()), &mut rows);
    let (title, frame) = (format!("{} {whom}{settle}", tree.name), taken.map(|taken| taken.caption.clone()));
    Outline { title, frame, rows, primitives: rules.by_name() }
}

/// `path` is what was taken from this branch on; none when the branch was not asked.
fn collect(rules: &Rules, branch: &Branch, depth: usize, path: Option<&[usize]>, rows: &mut Vec<Row>) {
    let taken = path.and_then(<[usize]>::first).copied();
    let last = branch.choices.len().saturating_sub(1);
    for (at, choice) in branch.choices.iter().enumerate() {
        let mark = match taken {
            Some(taken) if at < taken => Mark::Passed,
            Some(taken) if at == taken => Mark::Taken,
            _ => Mark::Quiet,
        };
        let condition = choice.condition.as_ref();
        rows.push(Row {
            depth,
            name: choice.name.clone(),
            condition: condition.map_or("else".to_string(), |condition| rules.text_of(condition)),
            leaf: match &choice.then {
                Consequent::Primitive(label) => Some(rules.label_name(*label)),
                Consequent::Stay => Some("stay".into()),
                Consequent::Separate => Some("separate".into()),
                Consequent::Branch(_) => None,
            },
            place: rules.sources.place(choice.span),
            is_last: at == last,
            mark,
        });
        if let Consequent::Branch(below) = &choice.then {
            let rest = path.filter(|_| mark == Mark::Taken).and_then(|path| path.get(1..));
            collect(rules, below, depth + 1, rest, rows);
        }
    }
}

impl Row {
    /// Returns the displayed text of the choice: `apart: not touching`.
    pub fn text(&self) -> String {
        self.name.as_ref().map_or_else(|| self.condition.clone(), |name| format!("{name}: {}", self.condition))
    }
}

impl Outline {
    /// The row that is asked when one is not taken.
    pub fn otherwise(&self, at: usize) -> Option<usize> {
        let row = self.rows.get(at).filter(|row| !row.is_last)?;
        (at + 1..self.rows.len()).find(|next| self.rows.get(*next).is_some_and(|next| next.depth == row.depth))
    }
}
