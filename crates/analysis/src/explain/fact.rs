//! Measured facts: numbers for programs, with a short text for people.

use serde::Serialize;

/// A slot of `fingers`.
pub(super) type Element = teachtree_base::hands::Finger;

/// The fact of a condition. Numbers are SI. The margin is the distance to the threshold: positive if the condition holds, negative if it does not.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Fact {
    /// A comparison.
    Compared {
        /// The left side.
        value: f64,
        /// The sign between.
        comparison: &'static str,
        /// The right side.
        threshold: f64,
        /// The margin; `None` for `==`.
        margin: Option<f64>,
        /// The SI unit.
        unit: String,
        /// The counted fingers or bodies of a count.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        holding: Vec<String>,
    },
    /// A hysteresis.
    Threshold {
        /// The compared value.
        value: f64,
        /// The threshold at which it becomes true.
        on: f64,
        /// The threshold at which it becomes false again.
        off: f64,
        /// Whether true is above.
        rising: bool,
        /// The margin to the threshold of the next change.
        margin: f64,
        /// Since when it is so, s; none when it is from the beginning.
        since_s: Option<f64>,
        /// The SI unit.
        unit: String,
    },
    /// A window.
    Window {
        /// The time for which it held.
        wait: Wait,
        /// Its length, s, in whole samples.
        wanted_s: f64,
    },
    /// A latch.
    Latch {
        /// Whether it is set.
        on: bool,
        /// The time at which it was set or cleared, s; `None` if it has not changed since the beginning.
        since_s: Option<f64>,
    },
    /// `from`: the leaf before.
    Before {
        /// The leaf, `separate` or `none`.
        leaf: String,
    },
    /// Two objects.
    Objects {
        /// The left side.
        one: String,
        /// The right side.
        other: String,
    },
    /// `any` and `all`.
    Slots {
        /// The fingers or bodies for which it holds.
        holding: Vec<String>,
        /// The count.
        of: usize,
    },
    /// A finger that the log does not have.
    Absent,
}

/// The part of a window for which a condition held, s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Wait {
    /// `for`: the time for which it has held without a break, at most the required one; `lasting`: the time for which it holds around now.
    Held(f64),
    /// `within last`: it last held so long ago.
    Ago(Option<f64>),
    /// `within next`: it will hold so much later.
    Ahead(Option<f64>),
    /// `bridging`: it last held so long ago, and will hold so much later.
    Around {
        /// The time since then.
        ago: Option<f64>,
        /// The time until then.
        ahead: Option<f64>,
    },
    /// `at least times within last`: it began so often.
    Begun {
        /// The number of beginnings.
        times: usize,
        /// The required number of beginnings.
        wanted: f64,
    },
}

impl Fact {
    /// In a few words; `holds` says whether the condition does.
    pub fn words(&self, holds: bool) -> String {
        match self {
            Self::Compared { value, threshold, .. } if value.is_nan() || threshold.is_nan() => "not known here".into(),
            Self::Threshold { value, .. } if value.is_nan() => "not known here".into(),
            Self::Compared { value, comparison, threshold, margin, unit, holding } => {
                let [value, threshold, margin_text] =
                    quantities([*value, *threshold, margin.unwrap_or(0.0).abs()], unit);
                let counted = if holding.is_empty() { String::new() } else { format!(" ({})", holding.join(", ")) };
                match margin {
                    Some(_) if holds => format!("{value}{counted} {comparison} {threshold}, {margin_text} to spare"),
                    Some(_) => format!("{value}{counted}, expected {comparison} {threshold}, {margin_text} short"),
                    None if holds => format!("{value}{counted} {comparison} {threshold}"),
                    None => format!("{value}{counted}, expected {comparison} {threshold}"),
                }
            }
            Self::Threshold { value, on, off, rising, margin, since_s, unit } => {
                let [value, on, off, margin] = quantities([*value, *on, *off, margin.abs()], unit);
                let since = since_s.map_or(" from the beginning".to_string(), |since| format!(" since {since:.3} s"));
                let (beyond, back) = if *rising { ("above", "below") } else { ("below", "above") };
                if holds {
                    format!("{value}, held{since}, lost {back} {off}: {margin} to spare")
                } else {
                    format!("{value}, expected {beyond} {on}, {margin} short")
                }
            }
            Self::Window { wait, wanted_s } => {
                let wanted = time(*wanted_s);
                match wait {
                    Wait::Held(_) if holds => format!("held for all of {wanted}"),
                    Wait::Held(held) => format!("held {} of {wanted}", time(*held)),
                    Wait::Ago(None) => format!("never so far, expected within the last {wanted}"),
                    Wait::Ago(Some(ago)) if *ago > 0.0 => format!("last {} ago, window {wanted}", time(*ago)),
                    Wait::Ago(Some(_)) | Wait::Ahead(Some(0.0)) => format!("now, window {wanted}"),
                    Wait::Ahead(None) => format!("never again, expected within the next {wanted}"),
                    Wait::Around { ago: Some(0.0), .. } => format!("now, window {wanted}"),
                    Wait::Around { ago, ahead } => {
                        let ago = ago.map_or("never so far".into(), |ago| format!("last {} ago", time(ago)));
                        let ahead = ahead.map_or("never again".into(), |ahead| format!("next {} ahead", time(ahead)));
                        let window = if holds { "window" } else { "expected both in less than" };
                        format!("{ago}, {ahead}, {window} {wanted}")
                    }
                    Wait::Begun { times, wanted: often } => {
                        let counted = if *times == 1 { "time" } else { "times" };
                        let asked = if holds { String::new() } else { format!(", expected {often}") };
                        format!("began {times} {counted} in the last {wanted}{asked}")
                    }
                    Wait::Ahead(Some(ahead)) => format!("{} ahead, window {wanted}", time(*ahead)),
                }
            }
            Self::Latch { on: true, since_s: Some(since) } => format!("set at {since:.3} s"),
            Self::Latch { on: true, since_s: None } => "set from the beginning".into(),
            Self::Latch { on: false, since_s: Some(since) } => format!("cleared at {since:.3} s"),
            Self::Latch { on: false, since_s: None } => "not set so far".into(),
            Self::Before { leaf } => format!("the leaf before is {leaf}"),
            Self::Objects { one, other } => format!("{one} and {other}"),
            Self::Slots { holding, of } if holding.is_empty() => format!("none of {of}"),
            Self::Slots { holding, of } => format!("{} of {of}: {}", holding.len(), holding.join(", ")),
            Self::Absent => "the log does not have this finger".into(),
        }
    }
}

/// A comparison in words, in three columns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ComparisonText {
    /// The measured value; for a count, also the counted fingers or bodies.
    pub value: String,
    /// The value or threshold of the comparison.
    pub threshold: String,
    /// The margin; empty for facts without a margin.
    pub margin: String,
}

impl Fact {
    /// The comparison, if it is one; `holds` says whether the condition does.
    pub fn measured(&self, holds: bool) -> Option<ComparisonText> {
        let word = if holds { "to spare" } else { "short" };
        Some(match self {
            Self::Compared { value, comparison, threshold, margin, unit, holding } => {
                let [value, threshold, left] = quantities([*value, *threshold, margin.unwrap_or(0.0).abs()], unit);
                let counted = if holding.is_empty() { String::new() } else { format!(" ({})", holding.join(", ")) };
                let margin = margin.map_or_else(String::new, |_| format!("{left} {word}"));
                ComparisonText { value: value + &counted, threshold: format!("{comparison} {threshold}"), margin }
            }
            Self::Threshold { value, on, off, rising, margin, unit, .. } => {
                let [value, on, off, left] = quantities([*value, *on, *off, margin.abs()], unit);
                let threshold = match (rising, holds) {
                    (true, false) => format!("above {on}"),
                    (true, true) => format!("until below {off}"),
                    (false, false) => format!("below {on}"),
                    (false, true) => format!("until above {off}"),
                };
                ComparisonText { value, threshold, margin: format!("{left} {word}") }
            }
            _ => return None,
        })
    }
}

/// A time for people.
pub fn time(seconds: f64) -> String {
    let [text] = quantities([seconds], "s");
    text
}

/// Numbers of one SI unit for people: all to the same prefix, three digits of the largest.
pub fn quantities<const N: usize>(numbers: [f64; N], unit: &str) -> [String; N] {
    let largest = numbers.iter().copied().filter(|number| number.is_finite()).map(f64::abs).fold(0.0, f64::max);
    let small = matches!(unit, "m" | "m/s" | "s") && largest < 1.0 || unit == "N" && largest < 0.1;
    let (scale, prefix) = if small && largest > 0.0 { (1e3, "m") } else { (1.0, "") };
    let top = largest * scale;
    let digits = if top == 0.0 || !top.is_finite() { 0 } else { (2.0 - top.log10().floor()).clamp(0.0, 6.0) as usize };
    // A small number beside a large one is not 0.
    let smallest = numbers.iter().map(|number| (number * scale).abs()).filter(|number| *number > 1e-6 * top);
    let first_digit = -smallest.fold(top, f64::min).log10().floor();
    let digits = if first_digit.is_finite() { digits.max(first_digit.clamp(0.0, 6.0) as usize) } else { digits };
    let gap = if unit.is_empty() { "" } else { " " };
    numbers.map(|number| {
        let text = format!("{:.digits$}", number * scale);
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        let text = if text == "-0" { "0" } else { text };
        format!("{text}{gap}{prefix}{unit}")
    })
}
