//! Looking things up in a rule set, and its digest.

use super::{Branch, Expr, ExprKind, Hand, Label, Param, PrimitiveId, Rules, Then, Tree, TreeScope};
use crate::base::diagnostic::Span;
use crate::base::digest::Digest;
use crate::base::hands::Side;
use crate::language::syntax::Whose;

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

    /// An expression as its author wrote it, on one line and without comments. Where the text does not say of which hand by name, as with
    /// `either.touching`, the hand stands before it.
    pub fn text_of(&self, expr: &Expr) -> String {
        let text = folded(self.sources.text(expr.span));
        let Some(side) = named_hand(expr) else { return text };
        match text.split_once('.') {
            Some((word, rest)) if Whose::from_name(word).is_some() && is_path(expr) => format!("{side}.{rest}"),
            _ if is_path(expr) => format!("{side}.{text}"),
            _ => {
                let says = |part: &Expr| {
                    named_hand(part).is_none() || {
                        let text = self.sources.text(part.span);
                        text.split('.')
                            .next()
                            .is_some_and(|word| !matches!(Whose::from_name(word), None | Some(Whose::Other)))
                    }
                };
                let mut unsaid = None;
                expr.walk(&mut |part| {
                    if is_path(part) && !says(part) && unsaid.is_none() {
                        let is_other = self.sources.text(part.span).starts_with("other.");
                        unsaid = named_hand(part).map(|side| if is_other { side.other() } else { side });
                    }
                });
                unsaid.map_or(text.clone(), |side| format!("{side}: {text}"))
            }
        }
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

/// Text of rules on one line, without comments.
pub fn folded(text: &str) -> String {
    let code = text.lines().map(|line| line.split("//").next().unwrap_or(""));
    code.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ")
}

/// The hand whose value an expression reads first, where it is named.
fn named_hand(expr: &Expr) -> Option<Side> {
    let mut found = None;
    expr.walk(&mut |part| {
        if let ExprKind::Channel(_, Hand::Named(side))
        | ExprKind::Signal(_, Hand::Named(side))
        | ExprKind::Latch(_, Hand::Named(side)) = part.kind
        {
            found = found.or(Some(side));
        }
    });
    found
}

/// Whether it is a name, perhaps with a component.
fn is_path(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Channel(..) | ExprKind::Signal(..) | ExprKind::Latch(..) => true,
        ExprKind::Component(inner, _) | ExprKind::Pick(inner, _) => is_path(inner),
        _ => false,
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
