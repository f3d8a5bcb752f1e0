//! Statistics of features, as lerobot normalizes by them: of each episode in the list of episodes, of all in `meta/stats.json`.
//!
//! Pictures are not decoded: their statistics are those of ImageNet, which `lerobot-train` takes for pictures by default.

use super::super::super::parquet::column::Values;
use serde_json::{Map, Value, json};

/// The quantiles that lerobot has, by name.
const QUANTILES: [(&str, f64); 5] = [("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)];
/// Mean and standard deviation of red, green and blue.
const IMAGENET: [(&str, [f64; 3]); 2] = [("mean", [0.485, 0.456, 0.406]), ("std", [0.229, 0.224, 0.225])];

/// The statistics of a feature in an episode.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Statistics {
    feature: String,
    is_picture: bool,
    count: usize,
    /// The statistics by name, with a number for each element.
    values: Vec<(&'static str, Vec<f64>)>,
}

impl Statistics {
    /// Those of vectors of a width, one after the other.
    pub fn of(feature: &str, width: usize, vectors: &[f32]) -> Self {
        let count = vectors.len() / width.max(1);
        let element =
            |at: usize| -> Vec<f64> { vectors.iter().skip(at).step_by(width.max(1)).copied().map(f64::from).collect() };
        let elements: Vec<Vec<f64>> = (0..width).map(element).map(sorted).collect();
        let of_each = |of: &dyn Fn(&[f64]) -> f64| elements.iter().map(|values| of(values)).collect::<Vec<f64>>();
        let mut values = vec![
            ("min", of_each(&|values| values.first().copied().unwrap_or_default())),
            ("max", of_each(&|values| values.last().copied().unwrap_or_default())),
            ("mean", of_each(&mean)),
            ("std", of_each(&deviation)),
        ];
        values.extend(QUANTILES.map(|(name, share)| (name, of_each(&|values| quantile(values, share)))));
        Self { feature: feature.into(), is_picture: false, count, values }
    }

    /// Those of the pictures of a camera; `colors` is the number of its colors.
    pub fn of_pictures(feature: &str, colors: usize, count: usize) -> Self {
        let all = |value: f64| vec![value; colors];
        let mut values = vec![("min", all(0.0)), ("max", all(1.0))];
        values.extend(IMAGENET.map(|(name, of)| (name, of.into_iter().take(colors).collect())));
        values.extend(QUANTILES.map(|(name, share)| (name, all(share))));
        Self { feature: feature.into(), is_picture: true, count, values }
    }

    /// The columns of the list of episodes, which all have the same features.
    pub fn columns(episodes: &[&[Self]]) -> Vec<(String, Values<'static>)> {
        let mut columns = Vec::new();
        for (at, first) in episodes.first().copied().unwrap_or_default().iter().enumerate() {
            let each = || episodes.iter().filter_map(|episode| episode.get(at));
            for (place, (name, _)) in first.values.iter().enumerate() {
                let lists = each().map(|of| of.values.get(place).map(|(_, values)| values.clone())).collect();
                columns.push((format!("stats/{}/{name}", first.feature), Values::NumberLists(lists)));
            }
            let counts = each().map(|of| Some(vec![i64::try_from(of.count).unwrap_or(i64::MAX)])).collect();
            columns.push((format!("stats/{}/count", first.feature), Values::IntegerLists(counts)));
        }
        columns
    }

    /// `stats.json`: all episodes together, as lerobot aggregates them. Quantiles are the means of those of the episodes, weighted with their frames.
    pub fn summary<'a>(episodes: impl Iterator<Item = &'a [Self]> + Clone) -> Value {
        let mut summary = Map::new();
        for (at, first) in episodes.clone().next().unwrap_or_default().iter().enumerate() {
            let each: Vec<&Self> = episodes.clone().filter_map(|episode| episode.get(at)).collect();
            let total: usize = each.iter().map(|of| of.count).sum();
            let means = weighted(&each, "mean", &|_, mean| mean);
            let mut of_feature = Map::new();
            for (name, _) in &first.values {
                let values = match *name {
                    "min" => folded(&each, name, f64::min),
                    "max" => folded(&each, name, f64::max),
                    "std" => spread(&each, &means),
                    name => weighted(&each, name, &|_, value| value),
                };
                // lerobot has the numbers of pictures in three dimensions.
                let value = |value: &f64| if first.is_picture { json!([[value]]) } else { json!(value) };
                of_feature.insert((*name).into(), values.iter().map(value).collect());
            }
            of_feature.insert("count".into(), json!([total]));
            summary.insert(first.feature.clone(), Value::Object(of_feature));
        }
        Value::Object(summary)
    }

    fn named(&self, name: &str) -> &[f64] {
        self.values.iter().find(|(known, _)| *known == name).map_or(&[], |(_, values)| values)
    }
}

fn folded(each: &[&Statistics], name: &str, fold: fn(f64, f64) -> f64) -> Vec<f64> {
    let lists = each.iter().map(|of| of.named(name).to_vec());
    lists.reduce(|one, other| one.iter().zip(&other).map(|(a, b)| fold(*a, *b)).collect()).unwrap_or_default()
}

/// The mean over all frames of a number of each element.
fn weighted(each: &[&Statistics], name: &str, number: &dyn Fn(usize, f64) -> f64) -> Vec<f64> {
    let total: usize = each.iter().map(|of| of.count).sum();
    let width = each.first().map_or(0, |of| of.named(name).len());
    let element = |at: usize| {
        let parts =
            each.iter().map(|of| of.count as f64 * number(at, of.named(name).get(at).copied().unwrap_or_default()));
        parts.sum::<f64>() / total.max(1) as f64
    };
    (0..width).map(element).collect()
}

/// The standard deviation over all frames, from those of the episodes and the distances of their means.
fn spread(each: &[&Statistics], means: &[f64]) -> Vec<f64> {
    let mean = |at: usize| means.get(at).copied().unwrap_or_default();
    let within = weighted(each, "std", &|_, deviation| deviation * deviation);
    let between = weighted(each, "mean", &|at, of_episode| (of_episode - mean(at)).powi(2));
    within.iter().zip(&between).map(|(one, other)| (one + other).sqrt()).collect()
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn deviation(values: &[f64]) -> f64 {
    let middle = mean(values);
    mean(&values.iter().map(|value| (value - middle).powi(2)).collect::<Vec<f64>>()).sqrt()
}

/// A quantile of sorted numbers, linear between them.
fn quantile(values: &[f64], share: f64) -> f64 {
    let at = share * values.len().saturating_sub(1) as f64;
    let (below, part) = (at.floor() as usize, at.fract());
    let value = |at: usize| values.get(at).or(values.last()).copied().unwrap_or_default();
    value(below) + part * (value(below + 1) - value(below))
}
