//! Which topics of a live log a binding needs.

/// The topics on which ROS publishes the transforms between frames.
const TRANSFORMS: [&str; 2] = ["/tf", "/tf_static"];

/// Which topics a binding may name.
#[derive(Clone, Debug)]
pub struct TopicFilter(Vec<String>);

impl TopicFilter {
    /// The topics with columns that may begin with one of these texts.
    pub fn new(starts: Vec<String>) -> Self {
        Self(starts)
    }

    /// Whether columns of this topic may be bound.
    pub fn may_name(&self, topic: &str) -> bool {
        let prefix = format!("{topic}.");
        self.0.iter().any(|start| start.starts_with(&prefix) || prefix.starts_with(start.as_str()))
    }

    /// Whether the topic is read: it may be bound, or has the transforms by which bound poses are composed.
    pub fn takes(&self, topic: &str) -> bool {
        self.may_name(topic) || TRANSFORMS.contains(&topic)
    }
}
