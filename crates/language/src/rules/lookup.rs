//! Looking things up in a rule set, and its digest.

use super::{Branch, Choice, Consequent, Expr, ExprKind, Hand, Label, Param, PrimitiveId, Rules, Tree, TreeScope};
use crate::syntax::HandPrefix;
use std::collections::BTreeMap;
use teachtree_base::diagnostic::Span;
use teachtree_base::digest::Digest;
use teachtree_base::hands::Side;

impl Rules {
    /// Returns the displayed name of a label: `Grasp`, `MainGrasp(left)`.
    pub fn label_name(&self, label: Label) -> String {
        let name = self.primitives.get(label.primitive.index()).map_or("?", |primitive| primitive.name.as_str());
        match label.side {
            Some(side) => format!("{name}({side})"),
            None => name.to_string(),
        }
    }

    /// The names of all labels that a leaf may give: of a sided primitive one for each side.
    pub fn label_names(&self) -> impl Iterator<Item = String> {
        self.labels().map(|label| self.label_name(label))
    }

    /// All labels that a leaf may give: of a sided primitive one for each side.
    pub fn labels(&self) -> impl Iterator<Item = Label> {
        self.primitives.iter().zip(0..).flat_map(|(primitive, at)| {
            let sides = if primitive.sided { Side::BOTH.map(Some).to_vec() } else { vec![None] };
            sides.into_iter().map(move |side| Label { primitive: PrimitiveId(at), side })
        })
    }

    /// The primitive with this name.
    pub fn primitive(&self, name: &str) -> Option<PrimitiveId> {
        let at = self.primitives.iter().position(|primitive| primitive.name == name)?;
        u32::try_from(at).ok().map(PrimitiveId)
    }

    /// The param with this name.
    pub fn param(&self, name: &str) -> Option<&Param> {
        self.params.iter().find(|param| param.name == name)
    }

    /// The tree with this scope.
    pub fn tree(&self, scope: TreeScope) -> Option<&Tree> {
        self.trees.iter().find(|tree| tree.scope == scope)
    }

    /// The smallest expression of a declaration or tree that holds a place, and whether each hand has its own.
    pub fn expr_at(&self, place: Span) -> Option<(&Expr, bool)> {
        let mut all: Vec<(&Expr, bool)> = Vec::new();
        all.extend(self.signals.iter().map(|signal| (&signal.expr, signal.per_hand)));
        all.extend(
            self.latches.iter().flat_map(|latch| [(&latch.set, latch.per_hand), (&latch.clear, latch.per_hand)]),
        );
        for tree in &self.trees {
            conditions(&tree.root, tree.scope == TreeScope::EachHand, &mut all);
        }
        let mut smallest: Option<(&Expr, bool)> = None;
        for (expr, per_hand) in all {
            expr.walk(&mut |part| {
                let holds =
                    part.span.file == place.file && part.span.start <= place.start && place.end <= part.span.end;
                let length = |expr: &Expr| expr.span.end - expr.span.start;
                if holds && smallest.is_none_or(|(known, _)| length(part) <= length(known)) {
                    smallest = Some((part, per_hand));
                }
            });
        }
        smallest
    }

    /// An expression as its author wrote it, on one line and without comments. A hand that the text does not name, as in `either.touching` or in a
    /// choice with `=> Primitive(side)`, stands where it is meant: `left.touching`.
    pub fn text_of(&self, expr: &Expr) -> String {
        let text = self.sources.text(expr.span);
        let mut hands: BTreeMap<usize, Option<(usize, Side)>> = BTreeMap::new();
        expr.walk(&mut |part| {
            if let Some((at, named)) = self.unsaid(part, expr.span) {
                // `either.touching` as a whole is of both.
                hands
                    .entry(at)
                    .and_modify(|other| *other = other.filter(|other| *other == named))
                    .or_insert(Some(named));
            }
        });
        let (mut written, mut done) = (String::new(), 0);
        for (at, named) in hands {
            if let Some((word, side)) = named {
                written.push_str(text.get(done..at).unwrap_or_default());
                written.push_str(&format!("{side}."));
                done = at + word;
            }
        }
        written.push_str(text.get(done..).unwrap_or_default());
        folded(&written)
    }

    /// Where in `whole` a hand has to stand that the text of a part does not name: its first byte, the length of what stands there instead
    /// (`either.`), and the hand.
    fn unsaid(&self, part: &Expr, whole: Span) -> Option<(usize, (usize, Side))> {
        let (ExprKind::Channel(_, Hand::Named(side))
        | ExprKind::Signal(_, Hand::Named(side))
        | ExprKind::Latch(_, Hand::Named(side))) = part.kind
        else {
            return None;
        };
        let is_within = part.span.file == whole.file && whole.start <= part.span.start && part.span.end <= whole.end;
        let word = self.sources.text(part.span).split_once('.').map(|(word, _)| word);
        let word = word.filter(|word| HandPrefix::from_name(word).is_some());
        let at = (part.span.start.checked_sub(whole.start)?) as usize;
        let is_said = word.is_some_and(|word| word == side.to_string());
        (is_within && !is_said).then(|| (at, (word.map_or(0, |word| word.len() + 1), side)))
    }

    /// A choice as its author wrote it, on one line, without comments and the brace of a branch. `=> Primitive(side)` stands for a choice of each
    /// hand: the text is that of the hand which is meant.
    pub fn choice_text(&self, choice: &Choice) -> String {
        let text = folded(self.sources.text(choice.span)).trim_end_matches('{').trim_end().to_string();
        match (&choice.then, &choice.condition) {
            (Consequent::Primitive(label), Some(condition)) if text.ends_with("(side)") => {
                let name = choice.name.as_ref().map_or(String::new(), |name| format!("{name}: "));
                format!("{name}{} => {}", self.text_of(condition), self.label_name(*label))
            }
            _ => text,
        }
    }

    /// Returns the digest of all texts and of the values of all params. It does not depend on the paths of the files.
    pub fn digest(&self) -> String {
        let mut digest = Digest::default();
        digest.count(self.sources.files.len());
        self.sources.files.iter().for_each(|source| digest.field(&source.text));
        for param in &self.params {
            digest.field(&param.name);
            digest.bytes(&param.value.to_bits().to_le_bytes());
        }
        digest.finish()
    }
}

/// Text of rules on one line, without comments.
pub fn folded(text: &str) -> String {
    let code = text.lines().map(|line| line.split("//").next().unwrap_or(""));
    code.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ")
}

fn conditions<'a>(branch: &'a Branch, per_hand: bool, all: &mut Vec<(&'a Expr, bool)>) {
    for choice in &branch.choices {
        all.extend(choice.condition.iter().map(|condition| (condition, per_hand)));
        if let Consequent::Branch(below) = &choice.then {
            conditions(below, per_hand, all);
        }
    }
}
