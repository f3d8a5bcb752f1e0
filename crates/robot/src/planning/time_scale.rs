//! One time scale for all hands: it maps the time of a group of tasks to the time of each hand's own plans.
//!
//! The operator's hands moved at the same time. A robot's hand may need longer for a part of the motion, and for parts that were not demonstrated.
//! Between two times of the recording at which a part of any hand begins, the time scale takes as long as the slowest hand; the others are slowed down by the same
//! factor. Simultaneous motions therefore stay simultaneous, and one hand waits for the other as in the demonstration.

/// Largest difference of equal times of the recording, s.
const SAME_S: f64 = 1e-6;

/// A part of the motion of a hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Start and end in the recording, s; equal for a part that was not demonstrated.
    pub demonstrated: [f64; 2],
    /// Its duration on the robot, s.
    pub needs_s: f64,
}

/// Maps the common time to the time of each hand.
#[derive(Clone, Debug, Default)]
pub struct TimeScale {
    hands: Vec<Vec<Knot>>,
    eased_s: f64,
}

/// Time over which the time scale stops and resumes, s.
const STANDS_S: f64 = 0.1;

/// A pause of the time scale for an event that no plan contains.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pause {
    /// From 0 (running) to 1 (stopped).
    stands: f64,
    waited_s: f64,
}

impl Pause {
    /// The total time stopped, s.
    pub const fn waited_s(&self) -> f64 {
        self.waited_s
    }

    /// Advances by a time, s, while the time scale stops or resumes.
    pub fn advance(&mut self, waits: bool, dt: f64) {
        let way = if waits { dt } else { -dt } / STANDS_S;
        self.stands = (self.stands + way).clamp(0.0, 1.0);
        self.waited_s += self.stands * dt;
    }
}

/// The time of a hand in its own parts at a time of the group, s, and its integral from the beginning, s².
#[derive(Clone, Copy, Debug, Default)]
struct Knot {
    clock: f64,
    own: f64,
    area: f64,
}

impl TimeScale {
    /// Returns the time scale of hands with ordered parts; a part that was demonstrated before the end of the previous one begins at that end. Changes of speed take
    /// `eased_s` before and after.
    pub fn of(hands: &[Vec<Part>], eased_s: f64) -> Self {
        let hands: Vec<Vec<Part>> = hands.iter().map(|parts| in_order(parts)).collect();
        let hands = hands.as_slice();
        let mut times: Vec<f64> = hands.iter().flatten().flat_map(|part| part.demonstrated).collect();
        times.sort_by(f64::total_cmp);
        times.dedup_by(|after, before| *after - *before < SAME_S);
        let mut made: Vec<Vec<Knot>> = hands.iter().map(|_| vec![Knot::default()]).collect();
        let mut now = 0.0;
        for (index, &time) in times.iter().enumerate() {
            let at_once = |part: &Part| {
                let shown = part.demonstrated[1] - part.demonstrated[0] >= SAME_S;
                if !shown && (part.demonstrated[0] - time).abs() < SAME_S { part.needs_s } else { 0.0 }
            };
            advance(hands, &mut made, &mut now, &at_once);
            let Some(&next) = times.get(index + 1) else { continue };
            let between = |part: &Part| {
                let [from, to] = part.demonstrated;
                let covers = from < time + SAME_S && to > next - SAME_S;
                if covers && to - from >= SAME_S { part.needs_s * (next - time) / (to - from) } else { 0.0 }
            };
            advance(hands, &mut made, &mut now, &between);
        }
        Self { hands: made, eased_s }
    }

    /// Returns its duration, s.
    pub fn duration(&self) -> f64 {
        self.hands.iter().filter_map(|knots| knots.last()).map(|knot| knot.clock).fold(0.0, f64::max)
    }

    /// Returns the time at which every hand has ended its parts, s: changes of speed make it a little longer.
    pub fn over(&self) -> f64 {
        self.duration() + self.eased_s
    }

    /// Returns the time of a hand in its own parts, s.
    pub fn at(&self, hand: usize, time: f64) -> f64 {
        let Some(knots) = self.hands.get(hand) else { return 0.0 };
        if self.eased_s <= 0.0 {
            return seen(knots, time).own;
        }
        // The mean over the time around now; before the beginning, the time is the initial one.
        let area = |time: f64| if time < 0.0 { time * knots[0].own } else { seen(knots, time).area };
        (area(time + self.eased_s) - area(time - self.eased_s)) / (2.0 * self.eased_s)
    }

    /// Returns the first time at which a hand is at a time of its own parts, s.
    pub fn when(&self, hand: usize, own: f64) -> f64 {
        let Some(knots) = self.hands.get(hand) else { return 0.0 };
        let after = knots.partition_point(|knot| knot.own < own);
        match (after.checked_sub(1).and_then(|before| knots.get(before)), knots.get(after)) {
            (Some(from), Some(to)) => from.clock + (to.clock - from.clock) * (own - from.own) / (to.own - from.own),
            (None, Some(first)) => first.clock,
            (last, None) => last.map_or(0.0, |last| last.clock),
        }
    }
}

/// Parts that do not overlap.
fn in_order(parts: &[Part]) -> Vec<Part> {
    let mut ended = f64::NEG_INFINITY;
    let ordered = parts.iter().map(|part| {
        let from = part.demonstrated[0].max(ended);
        ended = part.demonstrated[1].max(from);
        Part { demonstrated: [from, ended], ..*part }
    });
    ordered.collect()
}

/// Advances until every hand has completed its part.
fn advance(hands: &[Vec<Part>], made: &mut [Vec<Knot>], now: &mut f64, needs: &dyn Fn(&Part) -> f64) {
    let each: Vec<f64> = hands.iter().map(|parts| parts.iter().map(needs).sum()).collect();
    let longest = each.iter().copied().fold(0.0, f64::max);
    if longest <= 0.0 {
        return;
    }
    *now += longest;
    for (knots, own) in made.iter_mut().zip(each) {
        let Some(&before) = knots.last() else { continue };
        let area = before.area + longest * (before.own + own / 2.0);
        knots.push(Knot { clock: *now, own: before.own + own, area });
    }
}

/// Interpolates between two knots; constant after the last one.
fn seen(knots: &[Knot], time: f64) -> Knot {
    let index = knots.partition_point(|knot| knot.clock <= time).saturating_sub(1);
    let before = knots[index];
    let since = (time - before.clock).max(0.0);
    let speed = knots.get(index + 1).map_or(0.0, |next| (next.own - before.own) / (next.clock - before.clock));
    let own = before.own + speed * since;
    Knot { clock: time, own, area: before.area + since * (before.own + own) / 2.0 }
}
