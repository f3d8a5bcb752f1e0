//! The rows, by kind and name.

use super::abstract_value::{
    AbstractValue, abs, alike, all, any, lasting, length, part, product, same, total, unchanging, unknown,
};
use super::{CheckedForm, Kind, Operand, Operator, Output, Range, Signature, Summary};
use crate::rules::Function;

const fn form(written: &'static str, takes: &'static [Operand], gives: Output) -> Signature {
    Signature { written, takes, gives, range: Range::Computed, over_time: false }
}

const fn ranged(range: Range, form: Signature) -> Signature {
    Signature { range, ..form }
}

/// A form whose value is taken over time.
const fn over_time(form: Signature) -> Signature {
    Signature { over_time: true, ..form }
}

/// A row of which nothing is known but how it is written; the rest is added by `..`.
const fn row(
    kind: Kind,
    becomes: CheckedForm,
    name: &'static str,
    signatures: &'static [Signature],
    doc: &'static str,
    example: &'static str,
    known: fn(&[AbstractValue]) -> AbstractValue,
) -> Operator {
    Operator { name, kind, becomes, signatures, doc, example, never_negative: false, at_start: None, known }
}

/// What stands for a row that is missing.
pub(super) static UNKNOWN: Operator = row(Kind::Function, CheckedForm::Contact, "", &[], "", "", unknown);

/// The operators.
pub static OPERATORS: &[Operator] = &[
    Operator {
        never_negative: true,
        ..row(
            Kind::Function,
            CheckedForm::Call(Function::Abs),
            "abs",
            &[ranged(Range::Chosen, form("abs(x)", &[Operand::Scalar], Output::Same))],
            "the absolute value of a number",
            "abs(target.velocity.z) > 5 mm/s",
            abs,
        )
    },
    Operator {
        never_negative: true,
        ..row(
            Kind::Function,
            CheckedForm::Call(Function::Angle),
            "angle",
            &[
                form("angle(a, b)", &[Operand::Vec3, Operand::Vec3], Output::Angle),
                form("angle(r, s)", &[Operand::Rotation, Operand::Rotation], Output::Angle),
            ],
            "the angle between two vec3, or of the rotation from one rotation to another; 0 if one vec3 is zero",
            "angle(target.velocity, vec3(0, 0, 1)) > 60 deg",
            unknown,
        )
    },
    row(
        Kind::Function,
        CheckedForm::Call(Function::Cross),
        "cross",
        &[form("cross(a, b)", &[Operand::Vec3, Operand::Vec3], Output::CrossProduct)],
        "the cross product of two vec3",
        "any(norm(cross(contacts.force, contacts.normal)) > 1 N)",
        product,
    ),
    row(
        Kind::Function,
        CheckedForm::Call(Function::Dot),
        "dot",
        &[form("dot(a, b)", &[Operand::Vec3, Operand::Vec3], Output::Product)],
        "the dot product of two vec3",
        "any(dot(contacts.force, contacts.normal) > 1 N)",
        product,
    ),
    row(
        Kind::Function,
        CheckedForm::Call(Function::FromFrame),
        "from_frame",
        &[form("from_frame(v, target.rotation)", &[Operand::Vec3, Operand::Rotation], Output::Same)],
        "a vec3 of the frame of a body, expressed in the reference frame",
        "from_frame(vec3(0, 0, 1), target.rotation).z > 0.5",
        part,
    ),
    row(
        Kind::Function,
        CheckedForm::Contact,
        "in_contact",
        &[form(
            "in_contact(left.target, right.target)",
            &[Operand::OfHand("target"), Operand::OfHand("target")],
            Output::OneCondition,
        )],
        "whether the two hands' targets touch each other",
        "in_contact(left.target, right.target)",
        unknown,
    ),
    row(
        Kind::Function,
        CheckedForm::Call(Function::InFrame),
        "in_frame",
        &[form("in_frame(v, target.rotation)", &[Operand::Vec3, Operand::Rotation], Output::Same)],
        "a vec3 of the reference frame, expressed in the frame of a body",
        "in_frame(target.velocity, target.rotation).x > 10 mm/s",
        part,
    ),
    Operator {
        never_negative: true,
        ..row(
            Kind::Function,
            CheckedForm::Call(Function::Norm),
            "norm",
            &[form("norm(v)", &[Operand::Vec3], Output::Length)],
            "the length of a vec3",
            "norm(target.velocity) > 10 mm/s",
            length,
        )
    },
    row(
        Kind::Function,
        CheckedForm::Call(Function::SqueezeOf),
        "squeeze_of",
        &[form(
            "squeeze_of(left.fingers, right.fingers)",
            &[Operand::OfHand("fingers"), Operand::OfHand("fingers")],
            Output::Force,
        )],
        "the force with which both hands press an object between them",
        "squeeze_of(left.fingers, right.fingers) > 13 N",
        total,
    ),
    row(
        Kind::Function,
        CheckedForm::Call(Function::Tangential),
        "tangential",
        &[form("tangential(v, contacts.normal)", &[Operand::Vec3, Operand::Direction], Output::Same)],
        "the component of a vec3 perpendicular to a direction",
        "any(norm(tangential(contacts.force, contacts.normal)) > 1 N)",
        part,
    ),
    row(
        Kind::Function,
        CheckedForm::Call(Function::Vec3),
        "vec3",
        &[form("vec3(x, y, z)", &[Operand::Scalar, Operand::SameScalar, Operand::SameScalar], Output::Vec3)],
        "a vec3 from its components",
        "norm(target.velocity - vec3(0 m/s, 0 m/s, 10 mm/s)) > 20 mm/s",
        alike,
    ),
    row(
        Kind::Set,
        CheckedForm::Call(Function::All),
        "all",
        &[form("all(conditions)", &[Operand::Conditions], Output::OneCondition)],
        "whether every one of an array of conditions holds",
        "all(touches[opposing])",
        all,
    ),
    row(
        Kind::Set,
        CheckedForm::Call(Function::Any),
        "any",
        &[form("any(conditions)", &[Operand::Conditions], Output::OneCondition)],
        "whether one of an array of conditions holds",
        "any(fingers.contact)",
        any,
    ),
    Operator {
        never_negative: true,
        ..row(
            Kind::Set,
            CheckedForm::Call(Function::Count),
            "count",
            &[ranged(Range::Counted, form("count(conditions)", &[Operand::Conditions], Output::Count))],
            "how many of an array of conditions hold",
            "count(fingers.contact) >= 3",
            total,
        )
    },
    row(
        Kind::Set,
        CheckedForm::Call(Function::Max),
        "max",
        &[
            ranged(Range::Extreme, form("max(array)", &[Operand::Scalars], Output::Element)),
            ranged(Range::Chosen, form("max(a, b)", &[Operand::Scalar, Operand::SameScalar], Output::Same)),
            ranged(
                Range::Chosen,
                over_time(form("max(x over last 200 ms)", &[Operand::Scalar, Operand::Duration], Output::Same)),
            ),
            ranged(
                Range::Chosen,
                over_time(form("max(x since condition)", &[Operand::Scalar, Operand::Condition], Output::Same)),
            ),
        ],
        "the largest of an array, of two numbers, or of the samples of a number over time",
        "max(norm(fingers.force)) > max(max(load, 1 N) over last 200 ms)",
        unknown,
    ),
    row(
        Kind::Set,
        CheckedForm::Call(Function::Mean),
        "mean",
        &[
            form("mean(array)", &[Operand::Numbers], Output::Element),
            over_time(form("mean(x over last 200 ms)", &[Operand::NumberOrCondition, Operand::Duration], Output::Same)),
            over_time(form("mean(x since condition)", &[Operand::NumberOrCondition, Operand::Condition], Output::Same)),
        ],
        "the mean of an array, zero when it has no elements; or of the samples of a number over time, for a condition the share of them on which it holds",
        "norm(mean(mean(fingers.force) over last 200 ms)) > 1 N",
        total,
    ),
    row(
        Kind::Set,
        CheckedForm::Call(Function::Min),
        "min",
        &[
            ranged(Range::Extreme, form("min(array)", &[Operand::Scalars], Output::Element)),
            ranged(Range::Chosen, form("min(a, b)", &[Operand::Scalar, Operand::SameScalar], Output::Same)),
            ranged(
                Range::Chosen,
                over_time(form("min(x over last 200 ms)", &[Operand::Scalar, Operand::Duration], Output::Same)),
            ),
            ranged(
                Range::Chosen,
                over_time(form("min(x since condition)", &[Operand::Scalar, Operand::Condition], Output::Same)),
            ),
        ],
        "the smallest of an array, of two numbers, or of the samples of a number over time",
        "min(norm(fingers.force)) > min(min(load, 1 N) over last 200 ms)",
        unknown,
    ),
    row(
        Kind::Set,
        CheckedForm::Call(Function::Sum),
        "sum",
        &[form("sum(array)", &[Operand::Numbers], Output::Element)],
        "the sum of an array; zero when it has no elements",
        "norm(sum(fingers.force)) > 1 N",
        total,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Hysteresis,
        "above until below",
        &[form(
            "x above on until below off",
            &[Operand::Scalar, Operand::Threshold, Operand::Threshold],
            Output::Condition,
        )],
        "a hysteresis: true once the number is above the first threshold, until it is below the second one",
        "load above 3 N until below 2 N",
        unknown,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Temporal,
        "at least times within last",
        &[form(
            "(condition) at least 3 times within last 2 s",
            &[Operand::Condition, Operand::Times, Operand::Duration],
            Output::Condition,
        )],
        "true when the condition began to hold at least this often within the time that ends now",
        "(moving) at least 3 times within last 200 ms",
        lasting,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Hysteresis,
        "below until above",
        &[form(
            "x below on until above off",
            &[Operand::Scalar, Operand::Threshold, Operand::Threshold],
            Output::Condition,
        )],
        "a hysteresis: true once the number is below the first threshold, until it is above the second one",
        "target.position.z below 10 mm until above 12 mm",
        unknown,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Temporal,
        "bridging",
        &[form("(condition) bridging 130 ms", &[Operand::Condition, Operand::Duration], Output::Condition)],
        "true on frames less than the time after one on which the condition holds, and less than the time before one: shorter gaps are bridged",
        "(moving) bridging 200 ms",
        same,
    ),
    Operator {
        at_start: Some(false),
        ..row(
            Kind::Temporal,
            CheckedForm::Temporal,
            "falls",
            &[form("falls(condition)", &[Operand::Condition], Output::Condition)],
            "true on the frame on which the condition ceases to hold",
            "falls(moving)",
            unchanging,
        )
    },
    row(
        Kind::Temporal,
        CheckedForm::Temporal,
        "for",
        &[form("(condition) for 200 ms", &[Operand::Condition, Operand::Duration], Output::Condition)],
        "true when the condition has held for all of the time that ends now",
        "(moving) for 200 ms",
        lasting,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Summary(Summary::Earliest),
        "earliest",
        &[
            ranged(
                Range::Chosen,
                over_time(form("earliest(x over last 200 ms)", &[Operand::Value, Operand::Duration], Output::Same)),
            ),
            ranged(
                Range::Chosen,
                over_time(form("earliest(x since condition)", &[Operand::Value, Operand::Condition], Output::Same)),
            ),
        ],
        "the value at the beginning of a time that ends now, or when a condition last began",
        "target.position.z - earliest(target.position.z over last 200 ms) > 5 mm",
        same,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Summary(Summary::Integral),
        "integral",
        &[
            over_time(form(
                "integral(x over last 200 ms)",
                &[Operand::NumberOrCondition, Operand::Duration],
                Output::TimesTime,
            )),
            over_time(form(
                "integral(x since condition)",
                &[Operand::NumberOrCondition, Operand::Condition],
                Output::TimesTime,
            )),
        ],
        "a number added up over time, each sample times its duration; for a condition the time for which it holds",
        "integral(load over last 200 ms) > 0.1 N s",
        total,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Temporal,
        "lasting",
        &[form("(condition) lasting 200 ms", &[Operand::Condition, Operand::Duration], Output::Condition)],
        "true while the condition holds, from its first frame on, if it holds for at least the time; later frames decide that",
        "(moving) lasting 200 ms",
        lasting,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Rate,
        "rate",
        &[form("rate(x, 100 ms)", &[Operand::Number, Operand::Duration], Output::PerTime)],
        "the rate of change of a number: its difference over the time, divided by the time",
        "rate(target.position.z, 100 ms) > 5 mm/s",
        unchanging,
    ),
    Operator {
        at_start: Some(false),
        ..row(
            Kind::Temporal,
            CheckedForm::Temporal,
            "rises",
            &[form("rises(condition)", &[Operand::Condition], Output::Condition)],
            "true on the frame on which the condition begins to hold",
            "rises(moving)",
            unchanging,
        )
    },
    row(
        Kind::Temporal,
        CheckedForm::Temporal,
        "within last",
        &[form("(condition) within last 1 s", &[Operand::Condition, Operand::Duration], Output::Condition)],
        "true when the condition held on a frame of the time that ends now",
        "(moving) within last 200 ms",
        same,
    ),
    row(
        Kind::Temporal,
        CheckedForm::Temporal,
        "within next",
        &[form("(condition) within next 250 ms", &[Operand::Condition, Operand::Duration], Output::Condition)],
        "true when the condition holds on a frame of the time that begins now; it is known only when that time has passed",
        "(moving) within next 200 ms",
        same,
    ),
];
