//! The syntax tree: what a rule file says, word for word, with the place of every piece; names are not resolved yet.
//!
//! Documentation comments stay with their declarations and all comments are listed, so that a formatter can keep them.

use super::ops::{Samples, TemporalOperator};
use super::rules::{Arithmetic, Comparison, Repetition};
use teachtree_base::channels::{Axis, Shape};
use teachtree_base::diagnostic::Span;
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;

/// A rule file.
#[derive(Clone, Debug, Default)]
pub struct File {
    /// Its declarations in order.
    pub items: Vec<Item>,
    /// Every comment, from its first slash to the end of its line.
    pub comments: Vec<Span>,
    /// Names whose declarations could not be read: reported once there, so not again where they are used.
    pub broken: Vec<String>,
    /// Whether the rest of the file was not read, which was reported.
    pub is_cut: bool,
}

/// A word with its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name {
    /// The word.
    pub text: String,
    /// Where it stands.
    pub span: Span,
}

/// Words joined by dots: `left.target.velocity.z`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// The words; at least one.
    pub parts: Vec<Name>,
    /// Where it stands.
    pub span: Span,
}

impl Path {
    /// As it is written.
    pub fn text(&self) -> String {
        join(&self.parts)
    }

    /// Whose value is asked for, where that is written, and the names after it. `other`, `either` and `both` are names too: before
    /// nothing and before a component they are.
    pub fn whose(&self) -> (Option<HandPrefix>, &[Name]) {
        let Some((first, rest)) = self.parts.split_first() else { return (None, &[]) };
        let whose = HandPrefix::from_name(&first.text).filter(|whose| match (whose, rest.first()) {
            (HandPrefix::Side(_), _) => true,
            (_, Some(next)) => !matches!(next.text.as_str(), "x" | "y" | "z"),
            (_, None) => false,
        });
        (whose, if whose.is_some() { rest } else { &self.parts })
    }
}

/// The hands that a path may begin with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandPrefix {
    /// `left.`, `right.`
    Side(Side),
    /// `other.`: the other hand, in `for each hand`.
    Other,
    /// `either.`: whether a condition holds for one of the hands, or for both.
    Either,
    /// `both.`: whether it holds for both.
    Both,
}

impl HandPrefix {
    /// The prefixes other than `left` and `right`.
    pub const WORDS: [&str; 3] = ["other", "either", "both"];

    /// The hands that a word stands for.
    pub fn from_name(word: &str) -> Option<Self> {
        match word {
            "other" => Some(Self::Other),
            "either" => Some(Self::Either),
            "both" => Some(Self::Both),
            _ => Side::from_name(word).map(Self::Side),
        }
    }
}

/// Words joined by dots.
pub fn join(parts: &[Name]) -> String {
    parts.iter().map(|part| part.text.as_str()).collect::<Vec<_>>().join(".")
}

/// A declaration with its documentation.
#[derive(Clone, Debug)]
pub struct Item {
    /// The `///` lines above it, as one place.
    pub doc: Option<Span>,
    /// What it declares.
    pub kind: ItemKind,
    /// Where it stands, from its first word to its last.
    pub span: Span,
}

/// What an item declares.
#[derive(Clone, Debug)]
pub enum ItemKind {
    /// `use "stream.rules"`
    Use(Use),
    /// `stream { … }`
    Stream(Vec<Channel>),
    /// `param name = value in a .. b`
    Param(Param),
    /// `signal name = …`, alone or in `for each hand`
    Signal(Signal),
    /// `latch name set … clear …`, alone or in `for each hand`
    Latch(Latch),
    /// `for each hand { … }`: signals and latches.
    ForEachHand(Vec<Item>),
    /// `primitive A, B(side)`
    Primitives(Vec<Primitive>),
    /// `tree name for … { … }`
    Tree(Tree),
    /// `extend tree.branch … { … }`
    Extension(Extension),
    /// `task name = A .. B with …`
    Task(Task),
    /// `task name = task, task`
    Composite(Composite),
    /// `extend task name with …`
    TaskExtension(TaskExtension),
    /// `relabel { … }`
    Relabel(RelabelBlock),
}

/// `use "tap.rules" before "contact.rules"`: the names of files, with their places, quotes included.
#[derive(Clone, Debug)]
pub struct Use {
    /// The file.
    pub file: Name,
    /// The file in front of whose extensions those of this one come.
    pub before: Option<Name>,
}

/// A raw channel that a log must or may carry.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Whether it stands in `for each hand`.
    pub per_hand: bool,
    /// Its name.
    pub name: Path,
    /// Its type.
    pub ty: ValueType,
    /// What stands for it in a log that lacks it, when it is optional.
    pub default: Option<Expr>,
    /// Where it stands.
    pub span: Span,
}

/// `vec3 m/s per finger`
#[derive(Clone, Copy, Debug)]
pub struct ValueType {
    /// What an element is.
    pub shape: Shape,
    /// The dimension of an element.
    pub dimension: Dimension,
    /// What it runs over.
    pub axis: Option<Axis>,
    /// Where it stands.
    pub span: Span,
}

/// A threshold or duration.
#[derive(Clone, Debug)]
pub struct Param {
    /// Its name.
    pub name: Name,
    /// Its value.
    pub value: Expr,
    /// The ends of its range.
    pub range: Option<(Expr, Expr)>,
}

/// A value per frame.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Its name.
    pub name: Name,
    /// The type, when it is written.
    pub ty: Option<ValueType>,
    /// What it is; `None` for an abstract signal.
    pub value: Option<Expr>,
}

/// One bit of memory.
#[derive(Clone, Debug)]
pub struct Latch {
    /// Its name.
    pub name: Name,
    /// Sets it.
    pub set: Expr,
    /// Clears it.
    pub clear: Expr,
}

/// A declared primitive.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// Its name.
    pub name: Name,
    /// Whether `(side)` follows.
    pub sided: bool,
    /// The primitive that it is a kind of.
    pub is: Option<Name>,
    /// What a hand does in it; of a sided one, the hand of its side.
    pub does: Option<Name>,
    /// What the other hand does in it.
    pub other: Option<Name>,
}

/// The name of a primitive in leaves and patterns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The primitive.
    pub name: Name,
    /// The side, when it is written.
    pub side: Option<Side>,
    /// Where it stands, side included.
    pub span: Span,
}

/// A tree.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Its name.
    pub name: Name,
    /// Whether it is `for each hand` rather than `for left, right`.
    pub each_hand: bool,
    /// How long a leaf must last.
    pub settle: Option<Expr>,
    /// Its choices.
    pub choices: Vec<Choice>,
    /// From `tree` to its opening brace.
    pub head: Span,
}

/// Choices added to a branch of a tree.
#[derive(Clone, Debug)]
pub struct Extension {
    /// `tree` or `tree.branch`.
    pub place: Path,
    /// Where in the branch.
    pub anchor: Anchor,
    /// Where the anchor stands.
    pub anchor_span: Span,
    /// The choices.
    pub choices: Vec<Choice>,
}

/// Where an extension goes.
#[derive(Clone, Debug)]
pub enum Anchor {
    /// In front of all choices.
    First,
    /// Behind all choices, but in front of a final `else`.
    Last,
    /// In front of a choice.
    Before(Name),
    /// Behind a choice.
    After(Name),
}

/// One choice of a branch.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Its name.
    pub name: Option<Name>,
    /// Its condition; `None` for `else`.
    pub condition: Option<Expr>,
    /// What follows.
    pub then: Consequent,
    /// From its name or condition to its leaf or opening brace.
    pub span: Span,
}

/// The consequent of a choice: a leaf or more choices.
#[derive(Clone, Debug)]
pub enum Consequent {
    /// `=> Primitive`
    Primitive(Label),
    /// `=> Primitive(side)`: a choice of the left hand, then one of the right.
    EachSide(Label),
    /// `=> stay`
    Stay,
    /// `=> separate`
    Separate,
    /// `{ … }`
    Branch(Vec<Choice>),
    /// Something that could not be read and was reported.
    Broken,
}

/// A task.
#[derive(Clone, Debug)]
pub struct Task {
    /// Its name.
    pub name: Name,
    /// The primitive that opens a span.
    pub first: Label,
    /// The primitive that closes it.
    pub last: Label,
    /// Its keys.
    pub keys: Vec<Key>,
    /// Whether all keys are needed (`and`) rather than any (`or`).
    pub all_keys: bool,
    /// Primitives that must not occur.
    pub without: Vec<Label>,
    /// Whether `joined` stands.
    pub joined: bool,
    /// Whether `is failure` is written.
    pub failure: bool,
    /// The task that it comes before.
    pub before: Option<Name>,
}

/// A task that is made of tasks.
#[derive(Clone, Debug)]
pub struct Composite {
    /// Its name.
    pub name: Name,
    /// The tasks in their order, each with whether it may come several times in a row.
    pub parts: Vec<(Name, bool)>,
    /// Whether `is failure` is written.
    pub failure: bool,
}

/// `extend task name with …`
#[derive(Clone, Debug)]
pub struct TaskExtension {
    /// The task.
    pub name: Name,
    /// More keys.
    pub keys: Vec<Key>,
}

/// A key of a task.
#[derive(Clone, Debug)]
pub struct Key {
    /// The primitive.
    pub label: Label,
    /// What it asks.
    pub demands: Vec<(Demand, Expr)>,
    /// Where it stands.
    pub span: Span,
}

/// What a key asks of its primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// `lasting`
    Lasting,
    /// `travelling`
    Travelling,
    /// `turning`
    Turning,
}

/// `relabel { … }`, `relabel task { … }`
#[derive(Clone, Debug)]
pub struct RelabelBlock {
    /// The task it is for.
    pub task: Option<Name>,
    /// Its rules.
    pub rules: Vec<RelabelRule>,
}

/// A relabeling rule.
#[derive(Clone, Debug)]
pub struct RelabelRule {
    /// What it says.
    pub kind: RelabelKind,
    /// Where it stands.
    pub span: Span,
}

/// `X`, `(P or Q)`
pub type Labels = Vec<Label>;

/// What a relabeling rule says.
#[derive(Clone, Debug)]
pub enum RelabelKind {
    /// `X shorter than d between A and B becomes C`, also looking at both hands, where C may be `separate`.
    Between {
        /// X.
        what: Labels,
        /// Whether X is a run.
        run: bool,
        /// The bound on its length.
        shorter: Option<Expr>,
        /// A and B.
        between: (Labels, Labels),
        /// What stands between which in the other hand.
        other: Option<(Labels, Labels)>,
        /// C; `None` for `separate`.
        becomes: Option<Label>,
    },
    /// `X, Y become Z`
    Become {
        /// X, Y.
        what: Labels,
        /// Z.
        becomes: Label,
    },
    /// `sequence A, (B or C)*, D becomes E`
    Sequence {
        /// The elements.
        elements: Vec<(Labels, Repetition)>,
        /// E.
        becomes: Label,
    },
    /// `X in both without K becomes separate`
    Separate {
        /// X.
        what: Label,
        /// K.
        without: Labels,
    },
}

/// An expression.
#[derive(Clone, Debug)]
pub struct Expr {
    /// What it says.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
    /// How deeply it is nested, itself included; bounded, so that every pass may recurse.
    pub depth: u32,
}

/// What an expression says.
#[derive(Clone, Debug)]
pub enum ExprKind {
    /// `true`, `false`
    Bool(bool),
    /// `30 ms`, in SI; `bare` when no unit is written.
    Number {
        /// The value, SI.
        value: f64,
        /// Its dimension.
        dimension: Dimension,
        /// Whether no unit is written.
        bare: bool,
    },
    /// `left.target.velocity.z`
    Path(Path),
    /// `norm(x)`
    Call(Path, Vec<Expr>),
    /// `mean(x over last d)`, `earliest(x since c)`
    Summary(Path, Box<Expr>, Samples<Box<Expr>, Box<Expr>>),
    /// `from(A, none)`: the labels and whether `none` is listed.
    From(Vec<Label>, bool),
    /// `(x)`
    Group(Box<Expr>),
    /// `x[thumb]`
    Pick(Box<Expr>, Name),
    /// `f(x).z`
    Component(Box<Expr>, Name),
    /// `-x`
    Negate(Box<Expr>),
    /// `a + b`
    Arithmetic(Arithmetic, Box<Expr>, Box<Expr>),
    /// `a < b`
    Compare(Comparison, Box<Expr>, Box<Expr>),
    /// `not c`
    Not(Box<Expr>),
    /// `a and b and c`
    And(Vec<Expr>),
    /// `a or b or c`
    Or(Vec<Expr>),
    /// `x above a until below b`, `x below a until above b`
    Hysteresis {
        /// The quantity.
        value: Box<Expr>,
        /// Threshold to become true.
        on: Box<Expr>,
        /// Threshold to become false.
        off: Box<Expr>,
        /// Whether true is above.
        rising: bool,
    },
    /// `(c) for d`, `(c) within last d`: an operator over time and its condition
    Temporal(TemporalOperator<Box<Expr>>, Box<Expr>),
}

impl ExprKind {
    /// The expressions that this one is made of.
    pub fn parts(&self) -> Vec<&Expr> {
        match self {
            Self::Bool(_) | Self::Number { .. } | Self::Path(_) | Self::From(..) => Vec::new(),
            Self::Group(one) | Self::Pick(one, _) | Self::Component(one, _) | Self::Negate(one) | Self::Not(one) => {
                vec![one]
            }
            Self::Arithmetic(_, one, two)
            | Self::Compare(_, one, two)
            | Self::Summary(_, one, Samples::Last(two) | Samples::Since(two)) => vec![one, two],
            Self::Temporal(temporal, one) => {
                let constants = temporal.constants().into_iter().map(|constant| &**constant);
                std::iter::once(&**one).chain(constants).collect()
            }
            Self::Call(_, many) | Self::And(many) | Self::Or(many) => many.iter().collect(),
            Self::Hysteresis { value, on, off, .. } => vec![value, on, off],
        }
    }
}

impl Expr {
    /// An expression with its depth.
    pub fn new(kind: ExprKind, span: Span) -> Self {
        let depth = 1 + kind.parts().iter().map(|part| part.depth).max().unwrap_or(0);
        Self { kind, span, depth }
    }

    /// The expression without the parentheses around it.
    pub fn bare(&self) -> &Self {
        let mut expr = self;
        while let ExprKind::Group(inner) = &expr.kind {
            expr = inner;
        }
        expr
    }

    /// Whether it is a number without a unit.
    pub fn is_bare_number(&self) -> bool {
        matches!(self.bare().kind, ExprKind::Number { bare: true, .. })
    }

    /// Calls `visit` for this expression and everything in it.
    pub fn walk<'a>(&'a self, visit: &mut dyn FnMut(&'a Self)) {
        visit(self);
        for part in self.kind.parts() {
            part.walk(visit);
        }
    }
}
