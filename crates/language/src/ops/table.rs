//! The rows, by kind and name.

use super::known::{Known, abs, alike, all, any, lasting, length, part, product, same, total, unchanging, unknown};
use super::{Becomes, Form, Gives, Kind, Operator, Range, Summary, Takes};
use crate::rules::Function;

const fn form(written: &'static str, takes: &'static [Takes], gives: Gives) -> Form {
    Form { written, takes, gives, range: Range::Computed, over_time: false }
}

const fn ranged(range: Range, form: Form) -> Form {
    Form { range, ..form }
}

/// A form whose value is taken over time.
const fn over_time(form: Form) -> Form {
    Form { over_time: true, ..form }
}

/// A row of which nothing is known but how it is written; the rest is added by `..`.
const fn row(
    kind: Kind,
    becomes: Becomes,
    name: &'static str,
    forms: &'static [Form],
    doc: &'static str,
    example: &'static str,
    known: fn(&[Known]) -> Known,
) -> Operator {
    Operator { name, kind, becomes, forms, doc, example, never_negative: false, at_start: None, known }
}

/// What stands for a row that is missing.
pub(super) static UNKNOWN: Operator = row(Kind::Function, Becomes::Contact, "", &[], "", "", unknown);

/// The operators.
pub static OPERATORS: &[Operator] = &[
    Operator {
        never_negative: true,
        ..row(
            Kind::Function,
            Becomes::Call(Function::Abs),
            "abs",
            &[ranged(Range::Chosen, form("abs(x)", &[Takes::Scalar], Gives::Same))],
            "the size of a number, without its sign",
            "abs(target.velocity.z) > 5 mm/s",
            abs,
        )
    },
    Operator {
        never_negative: true,
        ..row(
            Kind::Function,
            Becomes::Call(Function::Angle),
            "angle",
            &[
                form("angle(a, b)", &[Takes::Vec3, Takes::Vec3], Gives::Angle),
                form("angle(r, s)", &[Takes::Rotation, Takes::Rotation], Gives::Angle),
            ],
            "the angle between two vec3, or of the turn from one rotation to another; 0 where one has no direction",
            "angle(target.velocity, vec3(0, 0, 1)) > 60 deg",
            unknown,
        )
    },
    row(
        Kind::Function,
        Becomes::Call(Function::Cross),
        "cross",
        &[form("cross(a, b)", &[Takes::Vec3, Takes::Vec3], Gives::CrossProduct)],
        "the vector product of two vec3",
        "any(norm(cross(contacts.force, contacts.normal)) > 1 N)",
        product,
    ),
    row(
        Kind::Function,
        Becomes::Call(Function::Dot),
        "dot",
        &[form("dot(a, b)", &[Takes::Vec3, Takes::Vec3], Gives::Product)],
        "the scalar product of two vec3",
        "any(dot(contacts.force, contacts.normal) > 1 N)",
        product,
    ),
    row(
        Kind::Function,
        Becomes::Call(Function::FromFrame),
        "from_frame",
        &[form("from_frame(v, target.rotation)", &[Takes::Vec3, Takes::Rotation], Gives::Same)],
        "a vec3 that is given in the frame of a body, in the reference frame",
        "from_frame(vec3(0, 0, 1), target.rotation).z > 0.5",
        part,
    ),
    row(
        Kind::Function,
        Becomes::Contact,
        "in_contact",
        &[form(
            "in_contact(left.target, right.target)",
            &[Takes::OfHand("target"), Takes::OfHand("target")],
            Gives::OneCondition,
        )],
        "whether the two hands' targets touch each other",
        "in_contact(left.target, right.target)",
        unknown,
    ),
    row(
        Kind::Function,
        Becomes::Call(Function::InFrame),
        "in_frame",
        &[form("in_frame(v, target.rotation)", &[Takes::Vec3, Takes::Rotation], Gives::Same)],
        "a vec3 of the reference frame in the frame of a body",
        "in_frame(target.velocity, target.rotation).x > 10 mm/s",
        part,
    ),
    Operator {
        never_negative: true,
        ..row(
            Kind::Function,
            Becomes::Call(Function::Norm),
            "norm",
            &[form("norm(v)", &[Takes::Vec3], Gives::Length)],
            "the length of a vec3",
            "norm(target.velocity) > 10 mm/s",
            length,
        )
    },
    row(
        Kind::Function,
        Becomes::Call(Function::SqueezeOf),
        "squeeze_of",
        &[form(
            "squeeze_of(left.fingers, right.fingers)",
            &[Takes::OfHand("fingers"), Takes::OfHand("fingers")],
            Gives::Force,
        )],
        "the force with which both hands press an object between them",
        "squeeze_of(left.fingers, right.fingers) > 13 N",
        total,
    ),
    row(
        Kind::Function,
        Becomes::Call(Function::Tangential),
        "tangential",
        &[form("tangential(v, contacts.normal)", &[Takes::Vec3, Takes::Direction], Gives::Same)],
        "the part of a vec3 that is at right angles to a direction",
        "any(norm(tangential(contacts.force, contacts.normal)) > 1 N)",
        part,
    ),
    row(
        Kind::Function,
        Becomes::Call(Function::Vec3),
        "vec3",
        &[form("vec3(x, y, z)", &[Takes::Scalar, Takes::SameScalar, Takes::SameScalar], Gives::Vec3)],
        "a vec3 of its components",
        "norm(target.velocity - vec3(0 m/s, 0 m/s, 10 mm/s)) > 20 mm/s",
        alike,
    ),
    row(
        Kind::Set,
        Becomes::Call(Function::All),
        "all",
        &[form("all(conditions)", &[Takes::Conditions], Gives::OneCondition)],
        "whether every one of an array of conditions holds",
        "all(touches[opposing])",
        all,
    ),
    row(
        Kind::Set,
        Becomes::Call(Function::Any),
        "any",
        &[form("any(conditions)", &[Takes::Conditions], Gives::OneCondition)],
        "whether one of an array of conditions holds",
        "any(fingers.contact)",
        any,
    ),
    Operator {
        never_negative: true,
        ..row(
            Kind::Set,
            Becomes::Call(Function::Count),
            "count",
            &[ranged(Range::Counted, form("count(conditions)", &[Takes::Conditions], Gives::Count))],
            "how many of an array of conditions hold",
            "count(fingers.contact) >= 3",
            total,
        )
    },
    row(
        Kind::Set,
        Becomes::Call(Function::Max),
        "max",
        &[
            ranged(Range::Extreme, form("max(array)", &[Takes::Scalars], Gives::Element)),
            ranged(Range::Chosen, form("max(a, b)", &[Takes::Scalar, Takes::SameScalar], Gives::Same)),
            ranged(
                Range::Chosen,
                over_time(form("max(x over last 200 ms)", &[Takes::Scalar, Takes::Duration], Gives::Same)),
            ),
            ranged(
                Range::Chosen,
                over_time(form("max(x since condition)", &[Takes::Scalar, Takes::Condition], Gives::Same)),
            ),
        ],
        "the largest of an array, of two numbers, or of the samples of a number over time",
        "max(norm(fingers.force)) > max(max(load, 1 N) over last 200 ms)",
        unknown,
    ),
    row(
        Kind::Set,
        Becomes::Call(Function::Mean),
        "mean",
        &[
            form("mean(array)", &[Takes::Numbers], Gives::Element),
            over_time(form("mean(x over last 200 ms)", &[Takes::NumberOrCondition, Takes::Duration], Gives::Same)),
            over_time(form("mean(x since condition)", &[Takes::NumberOrCondition, Takes::Condition], Gives::Same)),
        ],
        "the mean of an array, zero when it has no elements; or of the samples of a number over time, for a condition the share of them on which it holds",
        "norm(mean(mean(fingers.force) over last 200 ms)) > 1 N",
        total,
    ),
    row(
        Kind::Set,
        Becomes::Call(Function::Min),
        "min",
        &[
            ranged(Range::Extreme, form("min(array)", &[Takes::Scalars], Gives::Element)),
            ranged(Range::Chosen, form("min(a, b)", &[Takes::Scalar, Takes::SameScalar], Gives::Same)),
            ranged(
                Range::Chosen,
                over_time(form("min(x over last 200 ms)", &[Takes::Scalar, Takes::Duration], Gives::Same)),
            ),
            ranged(
                Range::Chosen,
                over_time(form("min(x since condition)", &[Takes::Scalar, Takes::Condition], Gives::Same)),
            ),
        ],
        "the smallest of an array, of two numbers, or of the samples of a number over time",
        "min(norm(fingers.force)) > min(min(load, 1 N) over last 200 ms)",
        unknown,
    ),
    row(
        Kind::Set,
        Becomes::Call(Function::Sum),
        "sum",
        &[form("sum(array)", &[Takes::Numbers], Gives::Element)],
        "the sum of an array; zero when it has no elements",
        "norm(sum(fingers.force)) > 1 N",
        total,
    ),
    row(
        Kind::Temporal,
        Becomes::Hysteresis,
        "above until below",
        &[form("x above on until below off", &[Takes::Scalar, Takes::Threshold, Takes::Threshold], Gives::Condition)],
        "a hysteresis: true once the number is above the first threshold, until it is below the second one",
        "load above 3 N until below 2 N",
        unknown,
    ),
    row(
        Kind::Temporal,
        Becomes::Temporal,
        "at least times within last",
        &[form(
            "(condition) at least 3 times within last 2 s",
            &[Takes::Condition, Takes::Times, Takes::Duration],
            Gives::Condition,
        )],
        "true when the condition began to hold so often within the time that ends now",
        "(moving) at least 3 times within last 200 ms",
        lasting,
    ),
    row(
        Kind::Temporal,
        Becomes::Hysteresis,
        "below until above",
        &[form("x below on until above off", &[Takes::Scalar, Takes::Threshold, Takes::Threshold], Gives::Condition)],
        "a hysteresis: true once the number is below the first threshold, until it is above the second one",
        "target.position.z below 10 mm until above 12 mm",
        unknown,
    ),
    Operator {
        at_start: Some(false),
        ..row(
            Kind::Temporal,
            Becomes::Temporal,
            "falls",
            &[form("falls(condition)", &[Takes::Condition], Gives::Condition)],
            "true on the frame on which the condition ceases to hold",
            "falls(moving)",
            unchanging,
        )
    },
    row(
        Kind::Temporal,
        Becomes::Temporal,
        "for",
        &[form("(condition) for 200 ms", &[Takes::Condition, Takes::Duration], Gives::Condition)],
        "true when the condition has held for all of the time that ends now",
        "(moving) for 200 ms",
        lasting,
    ),
    row(
        Kind::Temporal,
        Becomes::Summary(Summary::Earliest),
        "earliest",
        &[
            ranged(
                Range::Chosen,
                over_time(form("earliest(x over last 200 ms)", &[Takes::Value, Takes::Duration], Gives::Same)),
            ),
            ranged(
                Range::Chosen,
                over_time(form("earliest(x since condition)", &[Takes::Value, Takes::Condition], Gives::Same)),
            ),
        ],
        "what a value was at the beginning of a time that ends now, or when a condition last began",
        "target.position.z - earliest(target.position.z over last 200 ms) > 5 mm",
        same,
    ),
    row(
        Kind::Temporal,
        Becomes::Summary(Summary::Integral),
        "integral",
        &[
            over_time(form(
                "integral(x over last 200 ms)",
                &[Takes::NumberOrCondition, Takes::Duration],
                Gives::TimesTime,
            )),
            over_time(form(
                "integral(x since condition)",
                &[Takes::NumberOrCondition, Takes::Condition],
                Gives::TimesTime,
            )),
        ],
        "a number added up over time, each sample times its duration; for a condition the time for which it holds",
        "integral(load over last 200 ms) > 0.1 N s",
        total,
    ),
    row(
        Kind::Temporal,
        Becomes::Rate,
        "rate",
        &[form("rate(x, 100 ms)", &[Takes::Number, Takes::Duration], Gives::PerTime)],
        "how fast a number changes: its difference over the time, divided by the time",
        "rate(target.position.z, 100 ms) > 5 mm/s",
        unchanging,
    ),
    Operator {
        at_start: Some(false),
        ..row(
            Kind::Temporal,
            Becomes::Temporal,
            "rises",
            &[form("rises(condition)", &[Takes::Condition], Gives::Condition)],
            "true on the frame on which the condition begins to hold",
            "rises(moving)",
            unchanging,
        )
    },
    row(
        Kind::Temporal,
        Becomes::Temporal,
        "within last",
        &[form("(condition) within last 1 s", &[Takes::Condition, Takes::Duration], Gives::Condition)],
        "true when the condition held on a frame of the time that ends now",
        "(moving) within last 200 ms",
        same,
    ),
    row(
        Kind::Temporal,
        Becomes::Temporal,
        "within next",
        &[form("(condition) within next 250 ms", &[Takes::Condition, Takes::Duration], Gives::Condition)],
        "true when the condition holds on a frame of the time that begins now; it is known only when that time has passed",
        "(moving) within next 200 ms",
        same,
    ),
];
