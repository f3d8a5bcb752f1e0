//! Dimensions and units. All numbers inside the program are SI and `f64`; units exist only where text is read or written.

use std::fmt;

/// The physical dimension of a quantity, as exponents of meter, kilogram, second and radian.
///
/// The radian is a separate dimension, so that an angular velocity cannot be compared with a frequency.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Dimension {
    /// Exponent of the meter.
    pub metre: i8,
    /// Exponent of the kilogram.
    pub kilogram: i8,
    /// Exponent of the second.
    pub second: i8,
    /// Exponent of the radian.
    pub radian: i8,
}

impl Dimension {
    /// A plain number.
    pub const NONE: Self = Self::new(0, 0, 0, 0);
    /// A length, m.
    pub const LENGTH: Self = Self::new(1, 0, 0, 0);
    /// A mass, kg.
    pub const MASS: Self = Self::new(0, 1, 0, 0);
    /// A time, s.
    pub const TIME: Self = Self::new(0, 0, 1, 0);
    /// An angle, rad.
    pub const ANGLE: Self = Self::new(0, 0, 0, 1);
    /// A speed, m/s.
    pub const SPEED: Self = Self::new(1, 0, -1, 0);
    /// An acceleration, m/s^2.
    pub const ACCELERATION: Self = Self::new(1, 0, -2, 0);
    /// An angular speed, rad/s.
    pub const ANGULAR_SPEED: Self = Self::new(0, 0, -1, 1);
    /// A force, N.
    pub const FORCE: Self = Self::new(1, 1, -2, 0);
    /// A torque, N m.
    pub const TORQUE: Self = Self::new(2, 1, -2, 0);
    /// A frequency, Hz.
    pub const FREQUENCY: Self = Self::new(0, 0, -1, 0);

    /// Creates the dimension with these exponents.
    pub const fn new(metre: i8, kilogram: i8, second: i8, radian: i8) -> Self {
        Self { metre, kilogram, second, radian }
    }

    /// Returns the dimension of a product; `None` if an exponent overflows.
    pub fn times(self, other: Self) -> Option<Self> {
        Some(Self {
            metre: self.metre.checked_add(other.metre)?,
            kilogram: self.kilogram.checked_add(other.kilogram)?,
            second: self.second.checked_add(other.second)?,
            radian: self.radian.checked_add(other.radian)?,
        })
    }

    /// Returns the dimension of a quotient; `None` if an exponent overflows.
    pub fn over(self, other: Self) -> Option<Self> {
        self.times(other.to_the(-1)?)
    }

    /// Returns the dimension of a power; `None` if an exponent overflows.
    pub fn to_the(self, power: i8) -> Option<Self> {
        Some(Self {
            metre: self.metre.checked_mul(power)?,
            kilogram: self.kilogram.checked_mul(power)?,
            second: self.second.checked_mul(power)?,
            radian: self.radian.checked_mul(power)?,
        })
    }

    /// Returns the noun for this dimension with its article (`a force`), or `None` for a dimension without a name.
    pub fn word(self) -> Option<&'static str> {
        Some(match self {
            Self::NONE => "a plain number",
            Self::LENGTH => "a length",
            Self::MASS => "a mass",
            Self::TIME => "a time",
            Self::ANGLE => "an angle",
            Self::SPEED => "a speed",
            Self::ACCELERATION => "an acceleration",
            Self::ANGULAR_SPEED => "an angular speed",
            Self::FORCE => "a force",
            Self::TORQUE => "a torque",
            Self::FREQUENCY => "a frequency",
            _ => return None,
        })
    }

    /// Returns the SI unit of this dimension, such as `m/s` or `N`; empty for a plain number.
    pub fn si_unit(self) -> String {
        match self {
            Self::FORCE => return "N".into(),
            Self::TORQUE => return "N m".into(),
            Self::FREQUENCY => return "Hz".into(),
            _ => {}
        }
        let parts = [("kg", self.kilogram), ("m", self.metre), ("rad", self.radian), ("s", self.second)];
        let side = |sign: i8| {
            let words: Vec<String> = parts
                .iter()
                .filter(|(_, power)| power.signum() == sign)
                .map(|(name, power)| match power.unsigned_abs() {
                    1 => (*name).to_string(),
                    n => format!("{name}^{n}"),
                })
                .collect();
            words.join(" ")
        };
        match (side(1), side(-1)) {
            (up, down) if down.is_empty() => up,
            (up, down) => format!("{}/{}", if up.is_empty() { "1" } else { &up }, down.replace(' ', "/")),
        }
    }
}

impl fmt::Display for Dimension {
    /// `a force (N)`, `a plain number`, `kg/m`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.si_unit();
        match self.word() {
            Some(word) if unit.is_empty() => f.write_str(word),
            Some(word) => write!(f, "{word} ({unit})"),
            None => write!(f, "a quantity in {unit}"),
        }
    }
}

/// A named unit: its symbol, its size in SI, and its dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// The symbol in texts.
    pub symbol: &'static str,
    /// The size of one unit, SI.
    pub in_si: f64,
    /// The dimension.
    pub dimension: Dimension,
}

/// The units of rule files; their symbols are reserved names.
pub const UNITS: &[Unit] = &[
    Unit { symbol: "m", in_si: 1.0, dimension: Dimension::LENGTH },
    Unit { symbol: "mm", in_si: 1e-3, dimension: Dimension::LENGTH },
    Unit { symbol: "cm", in_si: 1e-2, dimension: Dimension::LENGTH },
    Unit { symbol: "um", in_si: 1e-6, dimension: Dimension::LENGTH },
    Unit { symbol: "s", in_si: 1.0, dimension: Dimension::TIME },
    Unit { symbol: "ms", in_si: 1e-3, dimension: Dimension::TIME },
    Unit { symbol: "N", in_si: 1.0, dimension: Dimension::FORCE },
    Unit { symbol: "mN", in_si: 1e-3, dimension: Dimension::FORCE },
    Unit { symbol: "kg", in_si: 1.0, dimension: Dimension::MASS },
    Unit { symbol: "g", in_si: 1e-3, dimension: Dimension::MASS },
    Unit { symbol: "rad", in_si: 1.0, dimension: Dimension::ANGLE },
    Unit { symbol: "deg", in_si: std::f64::consts::PI / 180.0, dimension: Dimension::ANGLE },
    Unit { symbol: "Hz", in_si: 1.0, dimension: Dimension::FREQUENCY },
    Unit { symbol: "kHz", in_si: 1e3, dimension: Dimension::FREQUENCY },
    Unit { symbol: "%", in_si: 1e-2, dimension: Dimension::NONE },
];

/// One pound-force, N: 0.45359237 kg under standard gravity.
const POUND_FORCE: f64 = 0.453_592_37 * 9.806_65;

/// Units of logs and bindings only; their symbols may be names in rules.
const OF_LOGS: &[Unit] = &[
    Unit { symbol: "us", in_si: 1e-6, dimension: Dimension::TIME },
    Unit { symbol: "µs", in_si: 1e-6, dimension: Dimension::TIME },
    Unit { symbol: "ns", in_si: 1e-9, dimension: Dimension::TIME },
    Unit { symbol: "µm", in_si: 1e-6, dimension: Dimension::LENGTH },
    // The same with the Greek letter in place of the micro sign.
    Unit { symbol: "μs", in_si: 1e-6, dimension: Dimension::TIME },
    Unit { symbol: "μm", in_si: 1e-6, dimension: Dimension::LENGTH },
    Unit { symbol: "min", in_si: 60.0, dimension: Dimension::TIME },
    Unit { symbol: "h", in_si: 3600.0, dimension: Dimension::TIME },
    Unit { symbol: "in", in_si: 0.0254, dimension: Dimension::LENGTH },
    Unit { symbol: "ft", in_si: 0.3048, dimension: Dimension::LENGTH },
    Unit { symbol: "kN", in_si: 1e3, dimension: Dimension::FORCE },
    Unit { symbol: "lbf", in_si: POUND_FORCE, dimension: Dimension::FORCE },
    Unit { symbol: "cN", in_si: 1e-2, dimension: Dimension::FORCE },
    Unit { symbol: "gf", in_si: 9.806_65e-3, dimension: Dimension::FORCE },
    Unit { symbol: "kgf", in_si: 9.806_65, dimension: Dimension::FORCE },
    Unit { symbol: "Nm", in_si: 1.0, dimension: Dimension::TORQUE },
    Unit { symbol: "N-m", in_si: 1.0, dimension: Dimension::TORQUE },
    Unit { symbol: "Nmm", in_si: 1e-3, dimension: Dimension::TORQUE },
    Unit { symbol: "N-mm", in_si: 1e-3, dimension: Dimension::TORQUE },
    Unit { symbol: "lbf-in", in_si: POUND_FORCE * 0.0254, dimension: Dimension::TORQUE },
    Unit { symbol: "lbf-ft", in_si: POUND_FORCE * 0.3048, dimension: Dimension::TORQUE },
    Unit { symbol: "°", in_si: std::f64::consts::PI / 180.0, dimension: Dimension::ANGLE },
];

/// Words that programs write for units, in small letters and without the `s` of a plural. Words with another meaning in titles, such as `second` and `foot`, are not
/// among them.
const WORDS: [(&str, &str); 25] = [
    ("meter", "m"),
    ("metre", "m"),
    ("millimeter", "mm"),
    ("millimetre", "mm"),
    ("centimeter", "cm"),
    ("centimetre", "cm"),
    ("micrometer", "um"),
    ("micrometre", "um"),
    ("micron", "um"),
    ("inche", "in"),
    ("inch", "in"),
    ("sec", "s"),
    ("msec", "ms"),
    ("millisecond", "ms"),
    ("usec", "us"),
    ("microsecond", "us"),
    ("nsec", "ns"),
    ("nanosecond", "ns"),
    ("minute", "min"),
    ("newton", "N"),
    ("millinewton", "mN"),
    ("radian", "rad"),
    ("degree", "deg"),
    ("kilogram", "kg"),
    ("hertz", "Hz"),
];

/// The symbol of a unit that is written as a word: `millimeters`, `Sec`.
fn symbol_of(word: &str) -> Option<&'static str> {
    let word = word.to_lowercase();
    let singular = word.strip_suffix('s').unwrap_or(&word);
    let found = WORDS.into_iter().find(|(known, _)| *known == word || *known == singular);
    // The singular is also an ordinal number.
    if word == "seconds" { Some("s") } else { found.map(|(_, symbol)| symbol) }
}

/// The unit with this symbol.
pub fn unit(symbol: &str) -> Option<Unit> {
    UNITS.iter().copied().find(|unit| unit.symbol == symbol)
}

/// Parses a compound unit such as `m`, `mm/s`, `rad/s`, `N m`, `kg/m^2` or `m/s/s`; an empty text or `1` is the plain number.
///
/// Returns its size in SI and its dimension, or the unknown part.
pub fn compound(text: &str) -> Result<(f64, Dimension), String> {
    product(text, by_symbol)
}

/// As [`compound`], for the titles of logs, in which units are also words: `Sec`, `millimeters`.
pub fn compound_of_log(text: &str) -> Result<(f64, Dimension), String> {
    product(text, |symbol| by_symbol(symbol).or_else(|| by_symbol(symbol_of(symbol)?)))
}

/// The symbol of a unit of a log that may be a word: `mm` for `millimeters`. A unit without a word is returned as it is.
pub fn symbol(unit: &str) -> &str {
    match by_symbol(unit) {
        Some(_) => unit,
        None => symbol_of(unit).unwrap_or(unit),
    }
}

fn by_symbol(symbol: &str) -> Option<Unit> {
    unit(symbol).or_else(|| OF_LOGS.iter().copied().find(|unit| unit.symbol == symbol))
}

fn product(text: &str, find: impl Fn(&str) -> Option<Unit>) -> Result<(f64, Dimension), String> {
    let mut in_si = 1.0;
    let mut dimension = Dimension::NONE;
    let text = text.trim();
    if text.is_empty() || text == "-" {
        return Ok((in_si, dimension));
    }
    for (place, over) in text.split('/').enumerate() {
        for factor in over.split(|c: char| c == '*' || c == '·' || c.is_whitespace()).filter(|part| !part.is_empty()) {
            if factor == "1" {
                continue;
            }
            let (symbol, power) = match factor.split_once('^') {
                Some((symbol, power)) => (symbol, power.parse::<i8>().map_err(|_| factor.to_string())?),
                None => (factor, 1),
            };
            let unit = find(symbol).ok_or_else(|| factor.to_string())?;
            let power = if place == 0 { power } else { power.checked_neg().ok_or_else(|| factor.to_string())? };
            in_si *= unit.in_si.powi(i32::from(power));
            dimension = unit
                .dimension
                .to_the(power)
                .and_then(|more| dimension.times(more))
                .ok_or_else(|| factor.to_string())?;
        }
    }
    Ok((in_si, dimension))
}

/// Parses a time, `3.41s` or `3410ms`, into s; a number without a unit is in seconds.
///
/// # Errors
/// Returns the expected form if `text` is not a time.
pub fn time(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let end = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at_checked(end).unwrap_or((text, ""));
    let wanted = || format!("expected a time such as 3.41s or 3410ms, found `{text}`");
    let number: f64 = number.trim().parse().map_err(|_| wanted())?;
    let (in_si, dimension) = compound(if unit.is_empty() { "s" } else { unit }).map_err(|_| wanted())?;
    let seconds = number * in_si;
    if dimension == Dimension::TIME && seconds.is_finite() { Ok(seconds) } else { Err(wanted()) }
}
