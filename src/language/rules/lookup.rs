//! Looking things up in a rule set, and its digest.

use super::{Branch, Expr, Label, Param, PrimitiveId, Rules, Then, Tree, TreeScope};
use crate::base::diagnostic::Span;
use crate::base::digest::Digest;
use crate::base::hands::Side;

impl Rules {
    /// The name of a label as it is shown: `Grasp`, `MainGrasp(left)`.
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

    /// A stable hash of all texts and of all values of params, as 16 hexadecimal digits (FNV-1a, 64 bits).
    ///
    /// It does not depend on where the files lie.
    pub fn digest(&self) -> String {
        let mut digest = Digest::default();
        self.sources.files.iter().for_each(|source| digest.text(&source.text));
        for param in &self.params {
            digest.add(param.name.bytes().chain(param.value.to_bits().to_le_bytes()));
        }
        digest.shown()
    }
}

fn conditions<'a>(branch: &'a Branch, per_hand: bool, all: &mut Vec<(&'a Expr, bool)>) {
    for choice in &branch.choices {
        all.extend(choice.condition.iter().map(|condition| (condition, per_hand)));
        if let Then::Branch(below) = &choice.then {
            conditions(below, per_hand, all);
        }
    }
}
