//! The search for the largest box of cells that can be certified.
//!
//! 1. Each quantity alone: bisection between the nominal value and the end of its range.
//! 2. A first box, from which cuts exclude failed runs, each at a quantity without whose variation the run succeeds. (Cuts of one face at a time: J. H. Friedman
//!    and N. I. Fisher, *Bump Hunting in High-Dimensional Data*, 1999.)
//! 3. Growth: each face moves outward until runs in the step beyond it fail that succeed with this quantity at the face.
//! 4. Verification of the whole box by new runs. If one fails, the box is cut, and 3 and 4 are repeated with a higher confidence
//!    ([`super::binomial::round_confidence`]).
//!
//! All points are drawn independently and uniformly, as the bound of Clopper and Pearson requires. Runs of one batch do not depend on each other, so the number
//! of threads does not change the result.

use super::binomial::{CONFIDENCE, RATE, lower_bound, round_confidence, runs_without_failure};
use super::cell_box::{CellBox, Face, Point, farthest};
use super::quantities::CellQuantity;
use crate::simulation::CellVariation;
use crate::simulation::fault::Fault;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Number of runs from one decision to the next.
const BATCH: usize = 16;
/// The shares of their own limits from which the first box is chosen. In it, at least half of the runs succeed.
const SHARES: [f64; 7] = [1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.0];
/// Number of successful runs in a box that is verified.
const REFINED: usize = 100;
/// Maximum number of verifications.
const ROUNDS: u32 = 12;

/// The bounds of a search.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Seed of the drawn points.
    pub seed: u64,
    /// Maximum number of runs.
    pub runs: usize,
}

/// Runs cells; receives the name of the stage. Returns the fault of each run, or `None` for a success.
pub type Runner<'r, E> = dyn FnMut(&str, &[CellVariation]) -> Result<Vec<Option<Fault>>, E> + 'r;

/// A failed run.
#[derive(Clone, Debug)]
pub struct Stop {
    /// The cell; with its seed, the run can be repeated.
    pub cell: CellVariation,
    /// The fault.
    pub fault: Fault,
}

/// A face of a certified box.
#[derive(Clone, Debug)]
pub struct FaceReport {
    /// The face.
    pub face: Face,
    /// Its distance from the nominal value, steps.
    pub reach: i32,
    /// The distance to which this quantity alone can be varied, steps, and the first failure beyond it.
    pub alone: i32,
    /// The first failure beyond `alone`; `None` at the end of the range.
    pub alone_stop: Option<Stop>,
    /// The first failure in the step beyond the face, with all quantities varied; `None` at the end of the range.
    pub stop: Option<Stop>,
    /// Numbers of failed runs and of all runs in that step.
    pub failed: [usize; 2],
}

/// A certified box.
#[derive(Clone, Debug)]
pub struct Certificate {
    /// The box.
    pub cells: CellBox,
    /// Its faces, without those of quantities that vary in one direction only.
    pub faces: Vec<FaceReport>,
    /// Number of verification runs, which all succeeded.
    pub verified: usize,
    /// The confidence of the verification, and the lower bound of the success rate with this confidence.
    pub confidence: f64,
    /// The lower bound.
    pub bound: f64,
    /// Number of all runs.
    pub runs: usize,
}

/// The reason for which a search finds no certificate.
#[derive(Clone, Debug)]
pub enum CertificationFailure {
    /// The run of the nominal cell fails.
    Nominal(Box<Fault>),
    /// The runs were used up.
    Runs(usize),
}

/// Searches for the largest box of these quantities that can be certified.
///
/// # Errors
/// Errors of the runner.
pub fn certify<E>(
    quantities: &[&'static CellQuantity],
    limits: Limits,
    run: &mut Runner<'_, E>,
) -> Result<Result<Certificate, CertificationFailure>, E> {
    let rng = ChaCha8Rng::seed_from_u64(limits.seed);
    let mut search = Search { quantities, run, rng, limit: limits.runs, runs: 0, known: Vec::new() };
    match search.certificate() {
        Ok(certificate) => Ok(Ok(certificate)),
        Err(Halt::Nominal(fault)) => Ok(Err(CertificationFailure::Nominal(fault))),
        Err(Halt::Runs) => Ok(Err(CertificationFailure::Runs(search.runs))),
        Err(Halt::Runner(error)) => Err(error),
    }
}

/// Why a search ends early.
enum Halt<E> {
    Nominal(Box<Fault>),
    Runs,
    Runner(E),
}

/// A run of a point.
struct Sample {
    point: Point,
    cell: CellVariation,
    fault: Option<Fault>,
    /// The faces in whose direction the run must be varied to fail, if they have been found.
    blamed: Option<Vec<Face>>,
    /// For faces with the run in the step beyond them, whether the run succeeds with this quantity at the face.
    checked: Vec<(Face, bool)>,
}

impl Sample {
    fn is_failure(&self) -> bool {
        self.fault.is_some()
    }

    /// Returns how far a face must move outward from the nominal value to contain the run, steps.
    fn reach(&self, face: Face) -> i32 {
        face.reach(&self.point).ceil() as i32
    }
}

/// How far one quantity alone can be varied in one direction.
struct Alone {
    face: Face,
    /// The largest distance with a success, and the smallest with a failure, steps.
    good: i32,
    bad: i32,
    stop: Option<Stop>,
}

struct Search<'s, 'r, E> {
    quantities: &'s [&'static CellQuantity],
    run: &'s mut Runner<'r, E>,
    rng: ChaCha8Rng,
    limit: usize,
    runs: usize,
    /// The runs of all drawn points.
    known: Vec<Sample>,
}

impl<E> Search<'_, '_, E> {
    fn certificate(&mut self) -> Result<Certificate, Halt<E>> {
        let nominal = self.evaluate("nominal", vec![vec![0.0; self.quantities.len()]])?;
        if let Some(fault) = nominal.into_iter().find_map(|sample| sample.fault) {
            return Err(Halt::Nominal(Box::new(fault)));
        }
        let alone = self.alone()?;
        let mut cells = self.first_box(&alone)?;
        self.refine(&mut cells)?;
        for round in 0..ROUNDS {
            loop {
                self.settle(&mut cells, &alone)?;
                let before = cells.clone();
                self.refine(&mut cells)?;
                if cells == before {
                    break;
                }
            }
            let confidence = round_confidence(round);
            let runs = runs_without_failure(confidence);
            if self.verify(&cells, runs)? {
                let bound = lower_bound(runs, runs, confidence);
                let faces = alone.into_iter().filter(|alone| farthest(self.quantities, alone.face) > 0);
                let faces = faces.map(|alone| self.report(&cells, alone)).collect();
                return Ok(Certificate { cells, faces, verified: runs, confidence, bound, runs: self.runs });
            }
            self.exclude(&mut cells)?;
        }
        Err(Halt::Runs)
    }

    /// Runs points, each with its own seed of the noise.
    fn evaluate(&mut self, stage: &str, points: Vec<Point>) -> Result<Vec<Sample>, Halt<E>> {
        let seeded =
            points.into_iter().enumerate().map(|(number, point)| (point, (self.runs + number) as u64)).collect();
        self.evaluate_seeded(stage, seeded)
    }

    /// Runs points with these seeds of the noise.
    fn evaluate_seeded(&mut self, stage: &str, points: Vec<(Point, u64)>) -> Result<Vec<Sample>, Halt<E>> {
        if self.runs + points.len() > self.limit {
            return Err(Halt::Runs);
        }
        let cell = |(point, seed): &(Point, u64)| {
            let mut cell = CellVariation { seed: *seed, ..CellVariation::default() };
            self.quantities.iter().zip(point).for_each(|(quantity, steps)| quantity.set(&mut cell, *steps));
            cell
        };
        let cells: Vec<CellVariation> = points.iter().map(cell).collect();
        self.runs += points.len();
        let faults = (self.run)(stage, &cells).map_err(Halt::Runner)?;
        let samples = points.into_iter().zip(cells).zip(faults);
        let sample = |(((point, _), cell), fault)| Sample { point, cell, fault, blamed: None, checked: Vec::new() };
        Ok(samples.map(sample).collect())
    }

    /// Runs points drawn from a box.
    fn explore(&mut self, stage: &str, cells: &CellBox, runs: usize) -> Result<(), Halt<E>> {
        let points = (0..runs).map(|_| cells.sample(&mut self.rng)).collect();
        let samples = self.evaluate(stage, points)?;
        self.known.extend(samples);
        Ok(())
    }

    /// Finds how far each quantity alone can be varied. A program that succeeds at the end of the range is taken to succeed on the way there.
    fn alone(&mut self) -> Result<Vec<Alone>, Halt<E>> {
        let nominal = CellBox::nominal(self.quantities.len());
        let begun = |face| Alone { face, good: 0, bad: farthest(self.quantities, face) + 1, stop: None };
        let mut all: Vec<Alone> = nominal.faces().map(begun).collect();
        loop {
            let is_open = |alone: &&mut Alone| alone.bad - alone.good > 1;
            let open: Vec<(&mut Alone, i32)> = all
                .iter_mut()
                .filter(is_open)
                .map(|alone| {
                    let steps = if alone.stop.is_none() { alone.bad - 1 } else { i32::midpoint(alone.good, alone.bad) };
                    (alone, steps)
                })
                .collect();
            if open.is_empty() {
                return Ok(all);
            }
            let point = |(alone, steps): &(&mut Alone, i32)| {
                let mut point = vec![0.0; self.quantities.len()];
                point[alone.face.quantity] = f64::from(alone.face.sign() * steps);
                point
            };
            let points = open.iter().map(point).collect();
            let samples = self.evaluate("each quantity alone", points)?;
            for ((alone, steps), Sample { cell, fault, .. }) in open.into_iter().zip(samples) {
                match fault {
                    None => alone.good = steps,
                    Some(fault) => (alone.bad, alone.stop) = (steps, Some(Stop { cell, fault })),
                }
            }
        }
    }

    /// Returns the first box: the largest share of all limits at which half of the runs succeed. Quantities without a limit are reduced last.
    fn first_box(&mut self, alone: &[Alone]) -> Result<CellBox, Halt<E>> {
        let shares = SHARES.map(|share| (share, 1.0)).into_iter().chain(SHARES.map(|share| (SHARES[4], share)));
        let mut cells = CellBox::nominal(self.quantities.len());
        for (limited, free) in shares {
            for alone in alone {
                let share = if alone.stop.is_some() { limited } else { free };
                cells.set(alone.face, (f64::from(alone.good) * share) as i32);
            }
            let before = self.known.len();
            self.explore("first box", &cells, BATCH)?;
            if self.known[before..].iter().filter(|sample| !sample.is_failure()).count() * 2 >= BATCH {
                break;
            }
        }
        Ok(cells)
    }

    /// Cuts the box until it contains no failed run and [`REFINED`] successful ones.
    fn refine(&mut self, cells: &mut CellBox) -> Result<(), Halt<E>> {
        loop {
            self.exclude(cells)?;
            let known = self.known.iter().filter(|it| !it.is_failure() && cells.contains(&it.point)).count();
            let missing = REFINED.saturating_sub(known);
            if missing == 0 {
                return Ok(());
            }
            self.explore("box", cells, missing.min(BATCH))?;
        }
    }

    /// Cuts the box until it contains no failed run. Each cut is at a quantity without whose variation a failed run succeeds, and excludes as many failed runs and as
    /// few successful ones as possible.
    fn exclude(&mut self, cells: &mut CellBox) -> Result<(), Halt<E>> {
        let is_left = |cells: &CellBox, sample: &Sample| sample.is_failure() && cells.contains(&sample.point);
        while let Some(at) = self.known.iter().position(|sample| is_left(cells, sample)) {
            let blamed = self.blame(at)?;
            let failed = &self.known[at];
            let inside: Vec<&Sample> = self.known.iter().filter(|sample| cells.contains(&sample.point)).collect();
            let worth = |face: &Face| {
                let reach = failed.reach(*face) - 1;
                let lost = inside.iter().filter(|sample| face.reach(&sample.point) > f64::from(reach));
                let (faults, fine): (Vec<&&Sample>, Vec<_>) = lost.partition(|sample| sample.is_failure());
                let kept = f64::from(reach + 1) / f64::from(cells.reach(*face) + 1);
                (faults.len() as f64 / (fine.len() + 1) as f64, kept, *face, reach)
            };
            let cuts = blamed.iter().map(worth);
            let best = cuts.reduce(|best, cut| if (cut.0, cut.1) > (best.0, best.1) { cut } else { best });
            // The nominal cell does not fail.
            let Some((.., face, reach)) = best else { return Err(Halt::Runs) };
            cells.set(face, reach);
        }
        Ok(())
    }

    /// Returns the faces in whose direction a failed run must be varied to fail.
    fn blame(&mut self, at: usize) -> Result<Vec<Face>, Halt<E>> {
        let Sample { point, cell, blamed, .. } = &self.known[at];
        if let Some(blamed) = blamed {
            return Ok(blamed.clone());
        }
        let nominal = CellBox::nominal(self.quantities.len());
        let varied: Vec<Face> = nominal.faces().filter(|face| face.reach(point) > 0.0).collect();
        let without = |face: &Face| {
            let mut point = point.clone();
            point[face.quantity] = 0.0;
            (point, cell.seed)
        };
        let points = varied.iter().map(without).collect();
        let samples = self.evaluate_seeded("causes", points)?;
        let blamed = varied.iter().zip(samples).filter(|(_, sample)| !sample.is_failure());
        let blamed: Vec<Face> = blamed.map(|(face, _)| *face).collect();
        // A run with two causes fails without each of them.
        let blamed = if blamed.is_empty() { varied } else { blamed };
        self.known[at].blamed = Some(blamed.clone());
        Ok(blamed)
    }

    /// Moves faces outward, until each has a failed run in the step beyond it or is at the end of its range. A face moves by several steps if the runs in these succeed.
    fn settle(&mut self, cells: &mut CellBox, alone: &[Alone]) -> Result<(), Halt<E>> {
        loop {
            let mut steps = Vec::new();
            let mut points = Vec::new();
            for Alone { face, good, .. } in alone {
                let (face, reach) = (*face, cells.reach(*face));
                if reach >= farthest(self.quantities, face) || self.witness(cells, face).is_some() {
                    continue;
                }
                let clear = self.clear_steps(cells, face, (*good - reach).max(1));
                if clear == 0 && self.unchecked(cells, face).is_none() {
                    continue;
                }
                steps.push(face);
                if clear > 0 {
                    let known = self.beyond(cells, face, clear).count();
                    let wanted = runs_beyond(cells.width(face.quantity), clear);
                    points.extend((known..wanted).map(|_| cells.sample_beyond(face, clear, &mut self.rng)));
                }
            }
            if steps.is_empty() {
                return Ok(());
            }
            let samples = self.evaluate("faces", points)?;
            self.known.extend(samples);
            if self.check_failures(cells, &steps)? {
                self.exclude(cells)?;
                continue;
            }
            let before = cells.clone();
            for Alone { face, good, .. } in alone.iter().filter(|alone| steps.contains(&alone.face)) {
                let clear = self.clear_steps(&before, *face, (*good - before.reach(*face)).max(1));
                if self.beyond(&before, *face, clear).count() >= runs_beyond(before.width(face.quantity), clear) {
                    cells.set(*face, before.reach(*face) + clear);
                }
            }
            // Where several faces have moved, runs beyond two of them may fail.
            while let Some(failed) = self.known.iter().find(|it| it.is_failure() && cells.contains(&it.point)) {
                let moved = cells.faces().find(|face| failed.reach(*face) > before.reach(*face));
                let Some(face) = moved else { break };
                cells.set(face, before.reach(face).max(failed.reach(face) - 1));
            }
        }
    }

    /// Returns the number of steps by which a face can move, at most `most`, without a known failed run; 0 if there is one in the first step.
    fn clear_steps(&self, cells: &CellBox, face: Face, most: i32) -> i32 {
        let most = most.min(farthest(self.quantities, face) - cells.reach(face));
        let failed = self.beyond(cells, face, most).filter(|sample| sample.is_failure());
        failed.map(|sample| sample.reach(face) - cells.reach(face) - 1).min().unwrap_or(most)
    }

    /// Repeats a failed run in the step beyond each face with its quantity at the face. Returns whether one still fails: its cause is in the box.
    fn check_failures(&mut self, cells: &CellBox, faces: &[Face]) -> Result<bool, Halt<E>> {
        let mut open = Vec::new();
        let mut points = Vec::new();
        for &face in faces {
            let Some(at) = self.unchecked(cells, face) else { continue };
            let Sample { point, cell, .. } = &self.known[at];
            let mut point = point.clone();
            point[face.quantity] = f64::from(face.sign() * cells.reach(face));
            points.push((point, cell.seed));
            open.push((at, face));
        }
        let samples = self.evaluate_seeded("faces", points)?;
        let mut fails = false;
        for ((at, face), sample) in open.into_iter().zip(samples) {
            self.known[at].checked.push((face, !sample.is_failure()));
            if sample.is_failure() {
                fails = true;
                self.known.push(sample);
            }
        }
        Ok(fails)
    }

    /// The runs in these steps beyond a face.
    fn beyond<'b>(&'b self, cells: &'b CellBox, face: Face, steps: i32) -> impl Iterator<Item = &'b Sample> {
        self.known.iter().filter(move |sample| cells.is_beyond(face, steps, &sample.point))
    }

    /// Returns the index of the first failed run in the step beyond a face that was not repeated with its quantity at the face.
    fn unchecked(&self, cells: &CellBox, face: Face) -> Option<usize> {
        let is_checked = |sample: &Sample| sample.checked.iter().any(|(checked, _)| *checked == face);
        self.known.iter().position(|it| it.is_failure() && !is_checked(it) && cells.is_beyond(face, 1, &it.point))
    }

    /// Returns the first run that failed because of the step beyond a face.
    fn witness<'b>(&'b self, cells: &'b CellBox, face: Face) -> Option<&'b Sample> {
        self.beyond(cells, face, 1).find(|sample| sample.checked.contains(&(face, true)))
    }

    /// Runs new points of the box until one fails. Returns whether all succeeded.
    fn verify(&mut self, cells: &CellBox, runs: usize) -> Result<bool, Halt<E>> {
        let mut done = 0;
        while done < runs {
            let before = self.known.len();
            self.explore("verification", cells, BATCH.min(runs - done))?;
            if self.known[before..].iter().any(Sample::is_failure) {
                return Ok(false);
            }
            done += self.known.len() - before;
        }
        Ok(true)
    }

    /// Reports a face of the certified box.
    fn report(&self, cells: &CellBox, alone: Alone) -> FaceReport {
        let Alone { face, good, stop: alone_stop, .. } = alone;
        let failed = self.beyond(cells, face, 1).filter(|sample| sample.is_failure()).count();
        let first = self.witness(cells, face).and_then(|sample| Some((sample.cell.clone(), sample.fault.clone()?)));
        FaceReport {
            face,
            reach: cells.reach(face),
            alone: good,
            alone_stop,
            stop: first.map(|(cell, fault)| Stop { cell, fault }),
            failed: [failed, self.beyond(cells, face, 1).count()],
        }
    }
}

/// Returns the number of runs in steps beyond a face that decide whether it can move there: their part of the largest sample of the larger box that one failure
/// refutes.
fn runs_beyond(width: i32, steps: i32) -> usize {
    let mut whole = runs_without_failure(CONFIDENCE);
    while lower_bound(whole, whole + 1, CONFIDENCE) < RATE {
        whole += 1;
    }
    let [width, steps] = [width, steps].map(|count| usize::try_from(count).unwrap_or(0));
    (whole * steps).div_ceil((width + steps).max(1))
}
