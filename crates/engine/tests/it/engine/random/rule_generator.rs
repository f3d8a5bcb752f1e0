//! Random checked rule sets.

use crate::numbers::Random;
use teachtree_base::channels::{Axis, DISTANCE_KNOWN, Shape};
use teachtree_base::diagnostic::Span;
use teachtree_base::hands::{Finger, FingerPick, Side};
use teachtree_base::units::Dimension;
use teachtree_language::ops::{Samples, Summary, TemporalOperator};
use teachtree_language::rules::*;

pub struct RuleGenerator {
    pub random: Random,
    pub rules: Rules,
    pub depth: u32,
    /// The numbers that are compared again, each with whether it may be one of the hand at hand.
    pub compared: Option<Vec<(bool, Expr)>>,
    /// What all numbers of the rules are multiples of, and what those that counts are compared with have more.
    pub unit: f64,
    pub more: f64,
}

/// Where an expression stands: what it may name.
#[derive(Clone, Copy)]
struct ExprContext {
    per_hand: bool,
    memory: bool,
    next: bool,
}

type ArrayOf = Option<(Axis, Hand)>;

impl RuleGenerator {
    pub fn make(mut self) -> Rules {
        for (name, sided) in [("A", false), ("B", false), ("C", false), ("D", true)] {
            self.rules.primitives.push(Primitive {
                name: name.into(),
                sided,
                is: None,
                does: None,
                other: None,
                span: Span::default(),
            });
        }
        for at in 0..self.random.below(6) {
            let per_hand = self.random.chance(60);
            let place = ExprContext { per_hand, memory: false, next: true };
            let hand = self.hand(place);
            let axis = if per_hand { self.axis(hand) } else { None };
            let axis = axis.filter(|(_, hand)| *hand == Hand::This);
            let expr = if self.random.chance(60) {
                self.bool(place, axis, self.depth)
            } else {
                self.number(place, axis, self.depth)
            };
            let ty = expr.ty;
            self.rules.signals.push(Signal { name: format!("s{at}"), per_hand, ty, expr });
        }
        for at in 0..self.random.below(4) {
            let per_hand = self.random.chance(70);
            let place = ExprContext { per_hand, memory: true, next: true };
            let (set, clear) = (self.bool(place, None, self.depth), self.bool(place, None, self.depth));
            self.rules.latches.push(Latch { name: format!("l{at}"), per_hand, set, clear, span: Span::default() });
        }
        for scope in [TreeScope::EachHand, TreeScope::BothHands] {
            if scope == TreeScope::EachHand || self.random.chance(60) {
                let mut root = self.branch(scope, self.depth);
                // `stay` is never reachable from `none` in checked rules.
                let label = self.label(2);
                let condition = Some(expr(ExprKind::From { labels: Vec::new(), none: true }, Shape::Bool, None));
                root.choices.insert(
                    0,
                    Choice { name: None, condition, then: Consequent::Primitive(label), span: Span::default() },
                );
                self.rules.trees.push(Tree { name: "t".into(), scope, settle: None, root, span: Span::default() });
            }
        }
        self.rules
    }

    fn branch(&mut self, scope: TreeScope, depth: u32) -> Branch {
        let place = ExprContext { per_hand: scope == TreeScope::EachHand, memory: true, next: true };
        let count = 1 + self.random.below(4);
        let mut choices: Vec<Choice> = (0..count)
            .map(|_| {
                let condition = Some(self.bool(place, None, depth));
                let then = if depth > 1 && self.random.chance(40) {
                    Consequent::Branch(self.branch(scope, depth - 1))
                } else {
                    self.leaf(scope)
                };
                Choice { name: None, condition, then, span: Span::default() }
            })
            .collect();
        let then = self.leaf(scope);
        choices.push(Choice { name: None, condition: None, then, span: Span::default() });
        Branch { choices, span: Span::default() }
    }

    fn leaf(&mut self, scope: TreeScope) -> Consequent {
        match self.random.below(8) {
            0 => Consequent::Stay,
            1 if scope == TreeScope::BothHands => Consequent::Separate,
            at => Consequent::Primitive(self.label(at)),
        }
    }

    fn label(&mut self, at: usize) -> Label {
        let primitive = PrimitiveId(at as u32 % 4);
        let side = (primitive.0 == 3).then(|| if self.random.chance(50) { Side::Left } else { Side::Right });
        Label { primitive, side }
    }

    fn hand(&mut self, place: ExprContext) -> Hand {
        match self.random.below(4) {
            0 => Hand::Named(Side::Left),
            1 => Hand::Named(Side::Right),
            2 if place.per_hand => Hand::Other,
            _ if place.per_hand => Hand::This,
            _ => Hand::Named(Side::Right),
        }
    }

    fn axis(&mut self, hand: Hand) -> ArrayOf {
        match self.random.below(3) {
            0 => Some((Axis::Fingers, hand)),
            1 => Some((Axis::Contacts, hand)),
            _ => None,
        }
    }

    fn comparison(&mut self) -> Comparison {
        [
            Comparison::Less,
            Comparison::LessEqual,
            Comparison::Greater,
            Comparison::GreaterEqual,
            Comparison::Equal,
            Comparison::NotEqual,
        ][self.random.below(6)]
    }

    fn threshold(&mut self, value: f64) -> Constant {
        self.constant(value * self.unit)
    }

    fn constant(&mut self, value: f64) -> Constant {
        Constant { value, dimension: Dimension::NONE, params: Vec::new(), span: Span::default() }
    }

    fn duration(&mut self) -> Constant {
        let frames = if self.random.chance(15) { 1 + self.random.below(140) } else { 1 + self.random.below(12) };
        self.constant(frames as f64 / 100.0)
    }

    fn boxed(&mut self, expr: Expr) -> Box<Expr> {
        Box::new(expr)
    }

    fn channel(&mut self, name: &str, hand: Hand) -> Expr {
        let at = self.rules.channels.iter().position(|channel| channel.name == name).unwrap();
        let spec = &self.rules.channels[at];
        let (shape, axis) = (spec.shape, spec.axis.map(|axis| (axis, hand)));
        let hand = if spec.per_hand { hand } else { Hand::Shared };
        expr(ExprKind::Channel(ChannelId(at as u32), hand), shape, axis)
    }

    /// An earlier signal of this shape, single or over this array.
    fn signal(&mut self, place: ExprContext, shape: Shape, axis: ArrayOf) -> Option<Expr> {
        let hand = axis.map_or_else(|| self.hand(place), |(_, hand)| hand);
        let fitting: Vec<usize> = (0..self.rules.signals.len())
            .filter(|at| {
                let signal = &self.rules.signals[*at];
                signal.ty.shape == shape && signal.ty.axis.map(|(axis, _)| axis) == axis.map(|(axis, _)| axis)
            })
            .collect();
        let at = *fitting.get(self.random.below(fitting.len().max(1)))?;
        let hand = if self.rules.signals[at].per_hand { hand } else { Hand::Shared };
        Some(expr(ExprKind::Signal(SignalId(at as u32), hand), shape, axis))
    }

    fn bool(&mut self, place: ExprContext, axis: ArrayOf, depth: u32) -> Expr {
        let of = |kind| expr(kind, Shape::Bool, axis);
        if self.compared.is_some() && axis.is_none() && self.random.chance(40) {
            return self.compared_again(place, depth);
        }
        if depth == 0 {
            return self.atom(place, axis);
        }
        let deeper = depth - 1;
        match self.random.below(16) {
            0 => self.atom(place, axis),
            1 => of(ExprKind::Not(Box::new(self.bool(place, axis, deeper)))),
            2 | 3 => {
                let (a, b) = (self.bool(place, axis, deeper), self.loose(place, axis, deeper));
                of(if self.random.chance(50) { ExprKind::And(vec![a, b]) } else { ExprKind::Or(vec![a, b]) })
            }
            4 | 5 => {
                let (a, b) = (self.number(place, axis, deeper), self.loose_number(place, axis, deeper));
                let comparison = self.comparison();
                of(ExprKind::Compare(comparison, Box::new(a), Box::new(b)))
            }
            6 | 7 => {
                let rising = self.random.chance(70);
                let (on, off) = if rising { (0.75, -0.25) } else { (-0.75, 0.25) };
                let (on, off) = (self.threshold(on), self.threshold(off));
                let value = self.number(place, axis, deeper);
                of(ExprKind::Hysteresis { value: self.boxed(value), on, off, rising })
            }
            8 | 9 => {
                let duration = self.duration();
                let window = match self.random.below(if place.next { 6 } else { 3 }) {
                    0 => TemporalOperator::For(duration),
                    1 => TemporalOperator::WithinLast(duration),
                    2 => {
                        // Half a time more is once more often.
                        let times = 1.0 + 0.5 * self.random.below(6) as f64;
                        TemporalOperator::AtLeast { times: self.constant(times), within: duration }
                    }
                    3 => TemporalOperator::Bridging(duration),
                    4 => TemporalOperator::Lasting(duration),
                    _ => TemporalOperator::WithinNext(duration),
                };
                let inner = if window.looks_ahead() { ExprContext { memory: false, ..place } } else { place };
                of(ExprKind::Temporal(window, Box::new(self.bool(inner, axis, deeper))))
            }
            10 => of(ExprKind::Temporal(TemporalOperator::Rises, Box::new(self.bool(place, axis, deeper)))),
            11 => of(ExprKind::Temporal(TemporalOperator::Falls, Box::new(self.bool(place, axis, deeper)))),
            12 | 13 if axis.is_none() => {
                let hand = self.hand(place);
                let array = self.axis(hand).unwrap_or((Axis::Fingers, hand));
                let inner = self.bool(place, Some(array), deeper);
                let function = if self.random.chance(50) { Function::Any } else { Function::All };
                of(ExprKind::Call(function, vec![inner]))
            }
            14 if axis.is_none() => {
                let hand = self.hand(place);
                let inner = self.bool(place, Some((Axis::Fingers, hand)), deeper);
                let count = expr(ExprKind::Call(Function::Count, vec![inner]), Shape::Scalar, None);
                let number = expr(ExprKind::Number(self.random.below(3) as f64 + self.more), Shape::Scalar, None);
                match self.random.below(3) {
                    0 => of(ExprKind::Compare(self.comparison(), Box::new(count), Box::new(number))),
                    1 => of(ExprKind::Compare(self.comparison(), Box::new(number), Box::new(count))),
                    _ => {
                        let (on, off) = (self.constant(1.5), self.constant(0.5));
                        of(ExprKind::Hysteresis { value: Box::new(count), on, off, rising: true })
                    }
                }
            }
            _ => {
                let signal = self.signal(place, Shape::Bool, axis);
                signal.unwrap_or_else(|| self.atom(place, axis))
            }
        }
    }

    fn compared_again(&mut self, place: ExprContext, depth: u32) -> Expr {
        let (one, other) = (self.compared_number(place, depth), self.compared_number(place, depth));
        let limit = expr(ExprKind::Number((self.random.below(5) as f64 - 2.0) * 0.5), Shape::Scalar, None);
        let comparison = self.comparison();
        let kind = match self.random.below(5) {
            0 | 1 => ExprKind::Compare(comparison, Box::new(one), Box::new(limit)),
            2 => ExprKind::Compare(comparison, Box::new(limit), Box::new(one)),
            3 => ExprKind::Compare(comparison, Box::new(one), Box::new(other)),
            _ => {
                let on = (self.random.below(5) as f64 - 2.0) * 0.5;
                let rising = self.random.chance(50);
                let (on, off) = (self.constant(on), self.constant(if rising { on - 0.5 } else { on + 0.5 }));
                ExprKind::Hysteresis { value: Box::new(one), on, off, rising }
            }
        };
        expr(kind, Shape::Bool, None)
    }

    fn compared_number(&mut self, place: ExprContext, depth: u32) -> Expr {
        let known = self.compared.iter().flatten().filter(|(per_hand, _)| *per_hand == place.per_hand);
        let known: Vec<Expr> = known.map(|(_, number)| number.clone()).collect();
        if !known.is_empty() && (known.len() > 2 || self.random.chance(60)) {
            return known[self.random.below(known.len())].clone();
        }
        let number = self.number(place, None, depth.min(2));
        self.compared.get_or_insert_default().push((place.per_hand, number.clone()));
        number
    }

    /// An operand beside an array: an array too, or a single value for every element.
    fn loose(&mut self, place: ExprContext, axis: ArrayOf, depth: u32) -> Expr {
        let axis = axis.filter(|_| self.random.chance(70));
        self.bool(place, axis, depth)
    }

    fn loose_number(&mut self, place: ExprContext, axis: ArrayOf, depth: u32) -> Expr {
        let axis = axis.filter(|_| self.random.chance(70));
        self.number(place, axis, depth)
    }

    fn atom(&mut self, place: ExprContext, axis: ArrayOf) -> Expr {
        match axis {
            Some((Axis::Fingers, hand)) => self.channel("fingers.contact", hand),
            Some((Axis::Contacts, hand)) => self.channel("contacts.handled", hand),
            None => {
                let hand = self.hand(place);
                match self.random.below(if place.memory { 9 } else { 6 }) {
                    0 => expr(ExprKind::Bool(self.random.chance(50)), Shape::Bool, None),
                    1 => self.channel("targets.contact", hand),
                    2 => {
                        let finger = Finger::ALL[self.random.below(6)];
                        let array = Box::new(self.channel("fingers.contact", hand));
                        expr(ExprKind::Pick(array, FingerPick::One(finger)), Shape::Bool, None)
                    }
                    3 => {
                        let pick = if self.random.chance(50) { FingerPick::Opposing } else { FingerPick::Tips };
                        let contact = self.channel("fingers.contact", hand);
                        let picked =
                            expr(ExprKind::Pick(Box::new(contact), pick), Shape::Bool, Some((Axis::Fingers, hand)));
                        expr(ExprKind::Call(Function::Any, vec![picked]), Shape::Bool, None)
                    }
                    4 => {
                        let (left, right) = (Hand::Named(Side::Left), Hand::Named(Side::Right));
                        let (a, b) = (self.channel("target", left), self.channel("target", right));
                        let comparison = if self.random.chance(50) { Comparison::Equal } else { Comparison::NotEqual };
                        expr(ExprKind::Compare(comparison, Box::new(a), Box::new(b)), Shape::Bool, None)
                    }
                    5 if matches!(hand, Hand::Named(Side::Left)) => self.channel(DISTANCE_KNOWN, hand),
                    5 => self.channel("target.over_socket", hand),
                    6 if !self.rules.latches.is_empty() => {
                        let at = self.random.below(self.rules.latches.len());
                        let hand = if self.rules.latches[at].per_hand { hand } else { Hand::Shared };
                        expr(ExprKind::Latch(LatchId(at as u32), hand), Shape::Bool, None)
                    }
                    _ => {
                        let labels = (0..1 + self.random.below(2))
                            .map(|_| Label { primitive: PrimitiveId(self.random.below(4) as u32), side: None })
                            .collect();
                        expr(ExprKind::From { labels, none: self.random.chance(30) }, Shape::Bool, None)
                    }
                }
            }
        }
    }

    fn number(&mut self, place: ExprContext, axis: ArrayOf, depth: u32) -> Expr {
        let of = |kind| expr(kind, Shape::Scalar, axis);
        if depth == 0 {
            return match axis {
                Some(_) => {
                    let vector = self.vector(place, axis);
                    of(ExprKind::Component(Box::new(vector), self.random.below(3) as u8))
                }
                None => {
                    let hand = self.hand(place);
                    let name = ["load", "target.depth", "closing"][self.random.below(3)];
                    self.channel(name, hand)
                }
            };
        }
        let deeper = depth - 1;
        match self.random.below(18) {
            14 | 15 => {
                let summary = Summary::ALL[self.random.below(5)];
                // Shares and times of conditions, too.
                let of_condition = matches!(summary, Summary::Mean | Summary::Integral) && self.random.chance(30);
                let samples = self.samples(place, axis, deeper);
                let free = ExprContext { memory: false, ..place };
                let value = if of_condition { self.bool(free, axis, deeper) } else { self.number(place, axis, deeper) };
                of(ExprKind::Summary(summary, Box::new(value), samples))
            }
            16 => {
                let (vector, samples) = (self.vector(place, axis), self.samples(place, axis, 0));
                let summary = [Summary::Mean, Summary::Integral, Summary::Earliest][self.random.below(3)];
                let over = expr(ExprKind::Summary(summary, Box::new(vector), samples), Shape::Vec3, axis);
                if self.random.chance(50) {
                    of(ExprKind::Call(Function::Norm, vec![over]))
                } else {
                    of(ExprKind::Component(Box::new(over), self.random.below(3) as u8))
                }
            }
            10 => {
                let (vector, duration) = (self.vector(place, axis), self.duration());
                let rate = expr(ExprKind::Rate(Box::new(vector), duration), Shape::Vec3, axis);
                if self.random.chance(50) {
                    of(ExprKind::Call(Function::Norm, vec![rate]))
                } else {
                    of(ExprKind::Component(Box::new(rate), self.random.below(3) as u8))
                }
            }
            11 => {
                let (a, b) = (self.vector(place, axis), self.vector(place, axis));
                of(ExprKind::Call(Function::Dot, vec![a, b]))
            }
            12 => of(ExprKind::Call(Function::Abs, vec![self.number(place, axis, deeper)])),
            13 => {
                let (a, b) = (self.number(place, axis, deeper), self.loose_number(place, axis, deeper));
                let function = if self.random.chance(50) { Function::Min } else { Function::Max };
                of(ExprKind::Call(function, vec![a, b]))
            }
            0 if axis.is_none() => {
                expr(ExprKind::Number((self.random.below(7) as f64 - 3.0) * 0.5 * self.unit), Shape::Scalar, None)
            }
            1 | 2 => {
                let (a, b) = (self.number(place, axis, deeper), self.loose_number(place, axis, deeper));
                let operation = [Arithmetic::Add, Arithmetic::Subtract, Arithmetic::Multiply, Arithmetic::Divide]
                    [self.random.below(4)];
                of(ExprKind::Arithmetic(operation, Box::new(a), Box::new(b)))
            }
            3 => of(ExprKind::Negate(Box::new(self.number(place, axis, deeper)))),
            4 => {
                let vector = self.vector(place, axis);
                match self.random.below(3) {
                    0 => {
                        let other = self.vector(place, axis);
                        of(ExprKind::Call(Function::Angle, vec![vector, other]))
                    }
                    _ => of(ExprKind::Call(Function::Norm, vec![vector])),
                }
            }
            5 => {
                let duration = self.duration();
                of(ExprKind::Rate(Box::new(self.number(place, axis, deeper)), duration))
            }
            6 if axis.is_none() => {
                let hand = self.hand(place);
                let array = self.axis(hand).unwrap_or((Axis::Contacts, hand));
                let inner = self.number(place, Some(array), deeper);
                let function = [Function::Sum, Function::Mean, Function::Min, Function::Max][self.random.below(4)];
                of(ExprKind::Call(function, vec![inner]))
            }
            7 if axis.is_none() => {
                let (left, right) = (Hand::Named(Side::Left), Hand::Named(Side::Right));
                let args = vec![self.channel("fingers.force", left), self.channel("fingers.force", right)];
                of(ExprKind::Call(Function::SqueezeOf, args))
            }
            8 if axis.is_none() => {
                let (hand, other) = (self.hand(place), self.hand(place));
                if self.random.chance(30) {
                    let rotations = [hand, other].map(|hand| self.channel("target.rotation", hand));
                    return of(ExprKind::Call(Function::Angle, rotations.to_vec()));
                }
                let forces = self.channel("fingers.force", hand);
                let sum = expr(ExprKind::Call(Function::Sum, vec![forces]), Shape::Vec3, None);
                of(ExprKind::Call(Function::Norm, vec![sum]))
            }
            _ => {
                let signal = self.signal(place, Shape::Scalar, axis);
                signal.unwrap_or_else(|| self.number(place, axis, 0))
            }
        }
    }

    /// Those of a duration, or since a condition began that the log alone says.
    fn samples(&mut self, place: ExprContext, axis: ArrayOf, depth: u32) -> Samples<Constant, Box<Expr>> {
        if self.random.chance(60) {
            return Samples::Last(self.duration());
        }
        let condition = self.loose(ExprContext { memory: false, ..place }, axis, depth);
        Samples::Since(Box::new(condition))
    }

    fn vector(&mut self, place: ExprContext, axis: ArrayOf) -> Expr {
        match axis {
            Some((Axis::Fingers, hand)) => {
                let (position, force) = (self.channel("fingers.position", hand), self.channel("fingers.force", hand));
                let rotation = self.channel("target.rotation", hand);
                match self.random.below(6) {
                    0 => position,
                    3 => expr(ExprKind::Call(Function::InFrame, vec![position, rotation]), Shape::Vec3, axis),
                    4 => expr(ExprKind::Call(Function::Cross, vec![force, position]), Shape::Vec3, axis),
                    1 => expr(ExprKind::Call(Function::Tangential, vec![position, force]), Shape::Vec3, axis),
                    _ => expr(
                        ExprKind::Arithmetic(Arithmetic::Subtract, Box::new(position), Box::new(force)),
                        Shape::Vec3,
                        axis,
                    ),
                }
            }
            Some((Axis::Contacts, hand)) => {
                let force = self.channel("contacts.force", hand);
                let velocity = self.channel("target.velocity", hand);
                expr(ExprKind::Arithmetic(Arithmetic::Subtract, Box::new(velocity), Box::new(force)), Shape::Vec3, axis)
            }
            None => {
                let hand = self.hand(place);
                let forces = self.channel("fingers.force", hand);
                match self.random.below(5) {
                    3 => {
                        let (velocity, rotation) =
                            (self.channel("target.velocity", hand), self.channel("target.rotation", hand));
                        expr(ExprKind::Call(Function::FromFrame, vec![velocity, rotation]), Shape::Vec3, None)
                    }
                    4 => {
                        let parts = ["load", "target.depth", "load"].map(|name| self.channel(name, hand));
                        expr(ExprKind::Call(Function::Vec3, parts.to_vec()), Shape::Vec3, None)
                    }
                    0 => expr(ExprKind::Call(Function::Sum, vec![forces]), Shape::Vec3, None),
                    1 => expr(ExprKind::Call(Function::Mean, vec![forces]), Shape::Vec3, None),
                    _ => self.channel("target.velocity", hand),
                }
            }
        }
    }
}

fn expr(kind: ExprKind, shape: Shape, axis: ArrayOf) -> Expr {
    Expr { kind, ty: Type { shape, dimension: Dimension::NONE, axis }, span: Span::default() }
}
