//! The names of a canonical log: what a column measures, read off its name (docs/logs.md).
//!
//! ```text
//! time                                            s
//! <channel>.<component>                           of [`LogChannel`]
//! left.label, right.label, both.label             true primitive, text, never read by the rules
//! left.task, right.task                           true task, text, never read by the rules
//! ```

use teachtree_base::channels::Shape;
use teachtree_base::hands::TrackId;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::units::{Dimension, compound_of_log};

/// The meaning of a column by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColumnMeaning<'a> {
    /// The name without the component: `right.thumb.force`.
    pub channel: &'a str,
    /// The component among `shape.components()`.
    pub component: usize,
    /// The kind of the whole channel.
    pub shape: Shape,
    /// Its dimension.
    pub dimension: Dimension,
    /// The bodies that the name mentions, which a scene has to know.
    pub bodies: [Option<&'a str>; 2],
}

/// The meaning of a column, or `None` for a name that is not canonical.
pub fn meaning(column: &str) -> Option<ColumnMeaning<'_>> {
    let whole = LogChannel::parse(column).filter(|channel| channel.shape().components().len() == 1);
    let (name, component, channel) = match whole {
        Some(channel) => (column, 0, channel),
        None => {
            let (name, last) = column.rsplit_once('.')?;
            let channel = LogChannel::parse(name)?;
            (name, channel.shape().components().iter().position(|component| *component == last)?, channel)
        }
    };
    let (shape, dimension, bodies) = (channel.shape(), channel.dimension(), channel.bodies());
    Some(ColumnMeaning { channel: name, component, shape, dimension, bodies })
}

/// Whether this column is ground truth: text that no rule reads.
pub fn is_label(column: &str) -> bool {
    matches!(column, "left.label" | "right.label" | "both.label" | "left.task" | "right.task")
}

/// Whether a body may have this name: it must not be taken for another part of a channel name.
pub fn is_body_name(name: &str) -> bool {
    let reserved = TrackId::from_name(name).is_some() || matches!(name, "contact" | "time");
    !name.is_empty()
        && !reserved
        && !name.contains(|c: char| c == '.' || c == ',' || c.is_whitespace() || c.is_control())
}

/// Splits `right.thumb.force.x [mN]` into name and unit; the unit is `None` when it is left out. The place in a list, `state[3]`, is not a unit.
pub fn split_unit(header: &str) -> (&str, Option<&str>) {
    let header = header.trim();
    let is_place = |text: &str| text.contains('<') || text.bytes().all(|byte| byte.is_ascii_digit());
    match header.strip_suffix(']').and_then(|head| head.rsplit_once('[')) {
        Some((name, unit)) if unit.is_empty() || !is_place(unit) => (name.trim_end(), Some(unit.trim())),
        _ => (header, None),
    }
}

/// Splits a title into name and unit where brackets hold a unit, `F_x [N]` or `F_x (N)`; else they are part of the name, as in `state[3]`.
pub fn split_known_unit(title: &str) -> (&str, Option<&str>) {
    let title = title.trim();
    let is_unit = |unit: &str| !unit.is_empty() && !unit.starts_with('1') && compound_of_log(unit).is_ok();
    let (name, unit) = match title.strip_suffix(')').and_then(|head| head.rsplit_once('(')) {
        Some((name, unit)) => (name.trim_end(), Some(unit.trim())),
        None => split_unit(title),
    };
    match unit {
        Some(unit) if is_unit(unit) && !name.is_empty() => (name, Some(unit)),
        _ => (title, None),
    }
}

/// Whether a title is that of a channel or of labels.
pub fn is_canonical(title: &str) -> bool {
    let (name, _) = split_unit(title);
    meaning(name).is_some() || is_label(name)
}
