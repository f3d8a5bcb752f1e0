//! Values of one frame, and what the functions of the language make of them.

use crate::semantics::absent;
use teachtree_base::channels::Shape;
use teachtree_language::rules::{Arithmetic, Expr, Function};

/// The value of an expression on a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Bool(bool),
    Number(f64),
    Vector(Vec<f64>),
    Array(Vec<Value>),
}

/// Returns the value of a hand or finger that the log lacks.
pub(super) fn nothing(shape: Shape) -> Value {
    let number = absent(shape);
    match shape {
        Shape::Bool => Value::Bool(number > 0.5),
        Shape::Scalar | Shape::Object => Value::Number(number),
        Shape::Vec3 | Shape::Rotation => Value::Vector(vec![number; shape.components().len()]),
    }
}

pub(super) const fn truth(value: &Value) -> bool {
    matches!(value, Value::Bool(true))
}

pub(super) const fn scalar(value: &Value) -> f64 {
    match value {
        Value::Number(number) => *number,
        _ => 0.0,
    }
}

pub(super) fn vector(value: &Value) -> &[f64] {
    match value {
        Value::Vector(vector) => vector,
        _ => &[],
    }
}

fn rotation(value: &Value) -> [f64; 4] {
    vector(value).try_into().unwrap_or_default()
}

pub(super) fn each(value: &Value, f: &dyn Fn(&Value) -> Value) -> Value {
    match value {
        Value::Array(slots) => Value::Array(slots.iter().map(f).collect()),
        one => f(one),
    }
}

pub(super) fn pairs(a: &Value, b: &Value, f: &dyn Fn(&Value, &Value) -> Value) -> Value {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => Value::Array(a.iter().zip(b).map(|(a, b)| f(a, b)).collect()),
        (Value::Array(a), b) => Value::Array(a.iter().map(|a| f(a, b)).collect()),
        (a, Value::Array(b)) => Value::Array(b.iter().map(|b| f(a, b)).collect()),
        (a, b) => f(a, b),
    }
}

pub(super) fn numbers(value: &Value, f: impl Fn(f64) -> f64) -> Value {
    match value {
        Value::Vector(vector) => Value::Vector(vector.iter().map(|number| f(*number)).collect()),
        other => Value::Number(f(scalar(other))),
    }
}

pub(super) fn arithmetic(operation: Arithmetic, a: &Value, b: &Value) -> Value {
    let f = |a: f64, b: f64| operation.apply(a, b);
    match (a, b) {
        (Value::Vector(a), Value::Vector(b)) => Value::Vector(a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()),
        (Value::Vector(_), b) => numbers(a, |a| f(a, scalar(b))),
        (a, Value::Vector(_)) => numbers(b, |b| f(scalar(a), b)),
        (a, b) => Value::Number(f(scalar(a), scalar(b))),
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let products = a.iter().zip(b).map(|(a, b)| a * b);
    products.reduce(|sum, product| sum + product).unwrap_or(0.0)
}

fn cross(a: &[f64], b: &[f64]) -> Vec<f64> {
    let part = |at: usize| {
        let (next, last) = ((at + 1) % 3, (at + 2) % 3);
        a[next] * b[last] - a[last] * b[next]
    };
    (0..3).map(part).collect()
}

/// The angle between two vec3, or of the turn between two rotations.
fn angle(a: &[f64], b: &[f64]) -> f64 {
    let ([aw, a_xyz @ ..], [bw, b_xyz @ ..]) = (a, b) else { return 0.0 };
    if a_xyz.len() < 3 {
        return norm(&cross(a, b)).atan2(dot(a, b));
    }
    let across = cross(a_xyz, b_xyz).into_iter().zip(a_xyz.iter().zip(b_xyz));
    let turn = across.map(|(across, (a, b))| aw * b - bw * a - across);
    let half = norm(&turn.collect::<Vec<f64>>()).atan2(dot(a, b).abs());
    half + half
}

/// A vec3 turned by the quaternion `(w, u)`: `v + w t + u × t` with `t = 2 u × v`.
fn turned(v: &Value, w: f64, u: &[f64]) -> Value {
    let twice: Vec<f64> = cross(u, vector(v)).into_iter().map(|part| part + part).collect();
    let across = cross(u, &twice).into_iter();
    let parts = vector(v).iter().zip(&twice).zip(across);
    Value::Vector(parts.map(|((v, t), across)| v + w * t + across).collect())
}

pub(super) fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

pub(super) fn sum(slots: &[Value], shape: Shape) -> Value {
    let mut slots = slots.iter().cloned();
    let first = slots.next().unwrap_or_else(|| nothing(shape));
    slots.fold(first, |sum, slot| arithmetic(Arithmetic::Add, &sum, &slot))
}

pub(super) fn call(function: Function, args: &[Value], expr: &Expr) -> Value {
    let slots = |at: usize| if let Some(Value::Array(slots)) = args.get(at) { slots.as_slice() } else { &[] };
    let nowhere = Value::Number(0.0);
    let (first, second) = (args.first().unwrap_or(&nowhere), args.get(1).unwrap_or(&nowhere));
    let bools = || slots(0).iter().map(truth);
    match function {
        Function::Abs => each(first, &|number| numbers(number, f64::abs)),
        Function::Norm => each(first, &|value| Value::Number(norm(vector(value)))),
        Function::Dot => pairs(first, second, &|a, b| Value::Number(dot(vector(a), vector(b)))),
        Function::Tangential => pairs(first, second, &|v, n| {
            let along = Value::Number(dot(vector(v), vector(n)));
            arithmetic(Arithmetic::Subtract, v, &arithmetic(Arithmetic::Multiply, n, &along))
        }),
        Function::Vec3 => {
            let third = args.get(2).unwrap_or(&nowhere);
            let two = pairs(first, second, &|x, y| Value::Vector(vec![scalar(x), scalar(y)]));
            pairs(&two, third, &|two, z| Value::Vector([vector(two), &[scalar(z)]].concat()))
        }
        Function::Cross => pairs(first, second, &|a, b| Value::Vector(cross(vector(a), vector(b)))),
        Function::Angle => pairs(first, second, &|a, b| Value::Number(angle(vector(a), vector(b)))),
        Function::InFrame => pairs(first, second, &|v, r| {
            let [w, x, y, z] = rotation(r);
            turned(v, w, &[-x, -y, -z])
        }),
        Function::FromFrame => pairs(first, second, &|v, r| {
            let [w, x, y, z] = rotation(r);
            turned(v, w, &[x, y, z])
        }),
        Function::Sum => sum(slots(0), expr.ty.shape),
        Function::Mean => {
            #[allow(clippy::cast_precision_loss, reason = "a handful of slots")]
            let count = slots(0).len().max(1) as f64;
            arithmetic(Arithmetic::Divide, &sum(slots(0), expr.ty.shape), &Value::Number(count))
        }
        Function::Min if args.len() == 2 => pairs(first, second, &|a, b| Value::Number(scalar(a).min(scalar(b)))),
        Function::Max if args.len() == 2 => pairs(first, second, &|a, b| Value::Number(scalar(a).max(scalar(b)))),
        Function::Min => Value::Number(slots(0).iter().map(scalar).fold(f64::INFINITY, f64::min)),
        Function::Max => Value::Number(slots(0).iter().map(scalar).fold(f64::NEG_INFINITY, f64::max)),
        Function::Count => Value::Number(bools().map(|bool| if bool { 1.0 } else { 0.0 }).sum()),
        Function::Any => Value::Bool(bools().any(|bool| bool)),
        Function::All => Value::Bool(bools().all(|bool| bool)),
        Function::SqueezeOf => {
            let forces: Vec<Value> = slots(0).iter().chain(slots(1)).cloned().collect();
            let norms: Vec<Value> = forces.iter().map(|force| Value::Number(norm(vector(force)))).collect();
            let (norms, total) = (sum(&norms, Shape::Scalar), sum(&forces, Shape::Vec3));
            Value::Number((scalar(&norms) - norm(vector(&total))) / 2.0)
        }
    }
}
