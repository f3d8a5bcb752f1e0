//! Two sequences of names side by side: the fewest insertions, deletions and replacements that make one the other (Levenshtein),
//! and which elements stand for each other.

/// The largest table that is filled, in pairs of segments.
pub const MAX_PAIRS: usize = 25_000_000;

/// Sequences side by side.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Alignment {
    /// The edit distance of the sequences.
    pub edits: usize,
    /// Elements with the same name that stand for each other, in order.
    pub pairs: Vec<(usize, usize)>,
}

/// The cost of a cell: edits first, then unmatched or renamed elements, then distance.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Cost(usize, usize, f64);

impl Cost {
    fn plus(self, edits: usize, alone: usize, distance: f64) -> Self {
        Self(self.0 + edits, self.1 + alone, self.2 + distance)
    }
}

/// The predecessor of a cell on the best path.
#[derive(Clone, Copy)]
enum Step {
    Diagonal,
    Deletion,
    Insertion,
}

/// Aligns two sequences of these lengths. Of the alignments with the fewest edits it is the one with the most pairs, and of those the one with the
/// least `distance` between the elements of a pair, all together. `None` when the table would be larger than [`MAX_PAIRS`].
pub(super) fn align(
    lengths: (usize, usize),
    same: impl Fn(usize, usize) -> bool,
    distance: impl Fn(usize, usize) -> f64,
) -> Option<Alignment> {
    let (ones, others) = lengths;
    if (ones + 1).saturating_mul(others + 1) > MAX_PAIRS {
        return None;
    }
    let mut steps: Vec<Step> = Vec::with_capacity((ones + 1) * (others + 1));
    let mut above: Vec<Cost> = Vec::new();
    for one in 0..=ones {
        let mut row: Vec<Cost> = Vec::with_capacity(others + 1);
        for other in 0..=others {
            let mut best: Option<(Cost, Step)> = None;
            let mut offer = |cost: Cost, step: Step| {
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, step));
                }
            };
            if let (Some(one), Some(other)) = (one.checked_sub(1), other.checked_sub(1))
                && let Some(cost) = above.get(other)
            {
                let cost = if same(one, other) { cost.plus(0, 0, distance(one, other)) } else { cost.plus(1, 2, 0.0) };
                offer(cost, Step::Diagonal);
            }
            if let Some(cost) = above.get(other) {
                offer(cost.plus(1, 1, 0.0), Step::Deletion);
            }
            if let Some(cost) = row.last() {
                offer(cost.plus(1, 1, 0.0), Step::Insertion);
            }
            let (cost, step) = best.unwrap_or((Cost(0, 0, 0.0), Step::Diagonal));
            row.push(cost);
            steps.push(step);
        }
        above = row;
    }
    let edits = above.last().map_or(0, |cost| cost.0);
    let (mut one, mut other) = (ones, others);
    let mut pairs = Vec::new();
    while one > 0 || other > 0 {
        match steps.get(one * (others + 1) + other)? {
            Step::Diagonal => {
                (one, other) = (one.checked_sub(1)?, other.checked_sub(1)?);
                if same(one, other) {
                    pairs.push((one, other));
                }
            }
            Step::Deletion => one = one.checked_sub(1)?,
            Step::Insertion => other = other.checked_sub(1)?,
        }
    }
    pairs.reverse();
    Some(Alignment { edits, pairs })
}
