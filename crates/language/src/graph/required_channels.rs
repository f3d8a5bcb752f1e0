//! The channels by which trees reach a label.

use super::{AbstractValue, Graph, reachable_leaves};
use crate::rules::{ChannelId, Label, TreeScope};
use std::collections::BTreeSet;
use teachtree_base::channels::{Axis, ChannelSpec, Fallback, Shape};

/// The channels by which trees reach a label.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RequiredChannels {
    /// Without one of these the label is never reached.
    pub all: Vec<String>,
    /// One of these is enough beside them; empty where they are enough by themselves.
    pub any: Vec<String>,
}

/// The channels by which the trees of a scope reach a label; `None` if they never reach it. A channel that a log lacks has its default, or zero.
pub fn required_channels(graph: &Graph, scope: TreeScope, label: Label) -> Option<RequiredChannels> {
    let readable = |channel: &ChannelSpec| channel.shape != Shape::Object;
    let channels: Vec<usize> =
        graph.channels.iter().enumerate().filter(|(_, channel)| readable(channel)).map(|(at, _)| at).collect();
    let reaches = |missing: &BTreeSet<usize>| {
        let value = |ChannelId(at): ChannelId, _| {
            let lacked = graph.channels.get(at as usize).filter(|_| missing.contains(&(at as usize)));
            lacked.map_or(AbstractValue::Unknown, absent)
        };
        reachable_leaves(graph, scope, value, |_, _| true).contains(&label)
    };
    if !reaches(&BTreeSet::new()) {
        return None;
    }
    let names = |of: &[usize]| {
        let mut names: Vec<String> =
            of.iter().filter_map(|at| graph.channels.get(*at)).map(|channel| channel.name.clone()).collect();
        names.sort();
        names
    };
    let (all, others): (Vec<usize>, Vec<usize>) = channels.iter().partition(|at| !reaches(&BTreeSet::from([**at])));
    let others: BTreeSet<usize> = others.into_iter().collect();
    let is_enough = |at: &usize| reaches(&others.iter().copied().filter(|other| other != at).collect());
    let any: Vec<usize> =
        if reaches(&others) { Vec::new() } else { others.iter().copied().filter(is_enough).collect() };
    Some(RequiredChannels { all: names(&all), any: names(&any) })
}

/// The value of a channel that a log lacks.
fn absent(channel: &ChannelSpec) -> AbstractValue {
    match (channel.axis, &channel.absent) {
        (Some(Axis::Contacts), _) => AbstractValue::Empty,
        (_, Fallback::Constant(value)) => AbstractValue::Constant(*value),
        _ => AbstractValue::Constant(0.0),
    }
}
