//! The shipped rules on what was taught in a shipped scene, over and over.

use teachtree::engine::evaluator::evaluate;
use teachtree::graph::{Graph, lower};
use teachtree::language::{self, Request};
use teachtree::report;
use teachtree::stream::frames::{Column, Frames, Values};
use teachtree::world::{shipped, teach};

/// Rules that are ready to run, and a log of at least so many frames in one stretch.
pub struct Shipped {
    pub graph: Graph,
    pub frames: Frames,
}

impl Shipped {
    /// Teaches a scene and repeats it.
    pub fn new(rules: &str, scene: &str, frames: usize) -> Self {
        let request = Request { files: vec![rules.into()], needs_tree: true, ..Request::default() };
        let rules = language::load(&request).rules.expect("shipped rules are right");
        let (scene, operator) = (shipped::scene(scene).expect("shipped"), shipped::operator(scene).expect("shipped"));
        let recording = teach(&scene, &operator, 1).expect("it can be taught");
        let log = teachtree::stream::frames(&recording, &report::channels(&rules)).expect("all channels are there");
        Self { graph: lower(&rules), frames: repeated(&log, frames) }
    }

    pub fn run(&self) -> usize {
        evaluate(&self.graph, &self.frames).expect("1 kHz suits the rules").len()
    }
}

fn repeated(log: &Frames, frames: usize) -> Frames {
    let times = frames.div_ceil(log.len);
    let column =
        |values: Values<'_>| -> Column { values.iter().map(|v| v as f32).collect::<Vec<f32>>().repeat(times).into() };
    let len = times * log.len;
    Frames {
        columns: log.columns.iter().map(|(key, values)| (*key, column(values.values()))).collect(),
        len,
        time: (0..len).map(|frame| frame as f64 / log.layout.rate_hz).collect(),
        stretches: std::iter::once(0..len).collect(),
        ..log.clone()
    }
}
