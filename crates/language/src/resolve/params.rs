//! Params: constants with a unit, computed from numbers and earlier params; overrides are applied here.

use super::Resolver;
use super::names::{Declarations, State};
use crate::rules::{Param, ParamId};
use crate::types::Scope;
use crate::{codes, parse, syntax};
use teachtree_base::diagnostic::Diagnostic;
use teachtree_base::units::Dimension;

impl Resolver {
    pub(super) fn params(&mut self, declared: &Declarations<'_>, overrides: &[(String, String)]) {
        for param in &declared.params {
            let value = self.param(param, overrides);
            let name = &param.name;
            // A name that is declared twice means its first declaration.
            if self.names.values.get(&name.text).is_none_or(|value| value.span != name.span) {
                continue;
            }
            let state = match value.zip(u32::try_from(self.rules.params.len()).ok()) {
                Some((value, id)) => {
                    self.rules.params.push(value);
                    State::Known(id)
                }
                None => State::Broken,
            };
            self.names.set_state(&name.text, state);
        }
        for (name, _) in overrides {
            if self.names.values.get(name).is_none_or(|value| value.what != super::ValueKind::Param) {
                self.unknown_override(name);
            }
        }
    }

    fn param(&mut self, param: &syntax::Param, overrides: &[(String, String)]) -> Option<Param> {
        let declared = self.constant(&param.value, None, Scope::SHARED)?;
        let dimension = declared.dimension;
        if let Some((low, high)) = &param.range {
            self.unit_of_range(&param.value, low, high)?;
        }
        let name = param.name.text.clone();
        let mut range = None;
        if let Some((low, high)) = &param.range {
            let low_end = self.constant(low, Some(dimension), Scope::SHARED)?;
            let high_end = self.constant(high, Some(dimension), Scope::SHARED)?;
            range = Some((low_end.value, high_end.value));
            if low_end.value > high_end.value {
                self.report(
                    Diagnostic::error(codes::OUT_OF_RANGE, format!("the range of `{name}` ends before it begins"))
                        .at(low.span.to(high.span), "the first end is the larger one"),
                );
                return None;
            }
            if !(low_end.value..=high_end.value).contains(&declared.value) {
                self.report(
                    Diagnostic::error(codes::OUT_OF_RANGE, format!("`{name}` lies outside its range"))
                        .at(param.value.span, "this is the value")
                        .at(low.span.to(high.span), "this is the range"),
                );
                return None;
            }
        }
        let value = match overrides.iter().rev().find(|(set, _)| *set == name) {
            Some((_, text)) => self.override_of(&name, text, dimension, range)?,
            None => declared.value,
        };
        Some(Param { name, value, dimension, range, span: param.name.span })
    }

    /// Reports a value without a unit whose range has one: the value is what is amiss, not the range.
    fn unit_of_range(&mut self, value: &syntax::Expr, low: &syntax::Expr, high: &syntax::Expr) -> Option<()> {
        if !value.is_bare_number() {
            return Some(());
        }
        let wanted = self.constant(low, None, Scope::SHARED)?.dimension;
        if wanted == Dimension::NONE {
            return Some(());
        }
        let finding = Diagnostic::error(codes::WRONG_TYPE, format!("{wanted} is expected here"))
            .at(value.span, "this is a plain number")
            .at(low.span.to(high.span), format!("its range is {wanted}"));
        self.report(self.with_units(finding, value.span, wanted));
        None
    }

    /// The value of an override in SI. Returns nothing after reporting what is wrong with it.
    fn override_of(&mut self, name: &str, text: &str, wanted: Dimension, range: Option<(f64, f64)>) -> Option<f64> {
        let message = format!("the override `{name}={text}`");
        let Some((value, dimension, bare)) = parse::quantity(text) else {
            let finding = Diagnostic::error(codes::BAD_OVERRIDE, format!("{message} is not a number with a unit"));
            self.report_override(name, finding.help(format!("`{name}` is {wanted}")));
            return None;
        };
        if dimension != wanted {
            let what = if bare { "has no unit".to_string() } else { format!("is {dimension}") };
            let finding = Diagnostic::error(codes::BAD_OVERRIDE, format!("{message} {what}, but `{name}` is {wanted}"));
            self.report_override(name, finding);
            return None;
        }
        if let Some((low, high)) = range.filter(|(low, high)| !(*low..=*high).contains(&value)) {
            let unit = wanted.si_unit();
            let finding = Diagnostic::error(
                codes::BAD_OVERRIDE,
                format!("{message} lies outside the range {low} {unit} .. {high} {unit} of `{name}`"),
            );
            self.report_override(name, finding);
            return None;
        }
        Some(value)
    }

    fn unknown_override(&mut self, name: &str) {
        // A binding is also used with rules that lack a param of the shipped ones.
        let has_no_effect = self.override_places.contains_key(name) && crate::is_shipped_param(name);
        if has_no_effect || self.names.incomplete || self.names.broken.contains(name) {
            return;
        }
        let known = self.rules.params.iter().map(|param| param.name.as_str());
        let finding = Diagnostic::error(codes::BAD_OVERRIDE, format!("there is no param `{name}` to override"));
        let finding = match super::nearest(name, known) {
            Some(near) => finding.help(format!("did you mean `{near}`?")),
            None => finding,
        };
        self.report_override(name, finding);
    }

    /// Reports an override with its place.
    fn report_override(&mut self, name: &str, finding: Diagnostic) {
        let finding = match self.override_places.get(name) {
            Some(place) => finding.note(format!("`{name}` is set in {place}")),
            None => finding,
        };
        self.report(finding);
    }

    /// A param by its id.
    pub fn param_value(&self, id: ParamId) -> Option<&Param> {
        self.rules.params.get(id.index())
    }
}
