//! The recordings of a set, each scored by the shipped rules and by the methods of the set.

use super::manifest::Set;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::Meta;
use teachtree_analysis::score::{self, KnownNames, NameMap, Stage, Tally, Truth};
use teachtree_analysis::{Analysis, TrackId};
use teachtree_session::{AnalysisInternals, Labels, LabelsInternals, Log, LogInternals, Rules, RulesInternals};

/// The title of the column of the shipped rules.
pub const SHIPPED: &str = "shipped rules";

/// What was found in a set.
#[derive(Default)]
pub struct MeasuredSet {
    pub recordings: Vec<MeasuredRecording>,
    /// Recordings that could not be measured, and why.
    pub errors: Vec<String>,
}

/// The tallies of a recording, by method; the shipped rules are the first one.
pub struct MeasuredRecording {
    pub log: PathBuf,
    pub tallies: Vec<(String, Tally)>,
}

impl MeasuredSet {
    /// The tally of a method over all recordings; `None` if the set is not measured by it.
    pub fn tally(&self, method: &str) -> Option<Tally> {
        let of_method = self.recordings.iter().flat_map(|it| &it.tallies).filter(|(name, _)| name == method);
        of_method.map(|(_, tally)| tally).fold(None, |sum: Option<Tally>, tally| {
            let mut sum = sum.unwrap_or_default();
            sum.add(tally);
            Some(sum)
        })
    }
}

/// A recording that the shipped rules have analyzed, and what is true of it.
pub struct AnalyzedRecording {
    pub log: Log,
    pub analysis: teachtree_session::Analysis,
    pub truth: Truth,
}

impl AnalyzedRecording {
    fn open(set: &Set, folder: &Path, map: &NameMap, path: &Path) -> Result<Self, String> {
        let log = Log::options().binding(set.binding()).open(path).map_err(|error| error.to_string())?;
        let rules = Rules::for_log(&log).map_err(|error| error.to_string())?;
        let analysis = rules.analyze(&log).map_err(|error| error.to_string())?;
        let mut labels = Labels::file(folder).map(set.map());
        if let Some(track) = set.manifest.track {
            labels = labels.track(TrackId::from(track));
        }
        let opened = log.opened().map_err(|error| error.to_string())?;
        let known = KnownNames::new(rules.set());
        let (truth, _) = labels.of(opened, analysis.found(), map, &known).map_err(|error| error.to_string())?;
        Ok(Self { log, analysis, truth })
    }
}

/// Measures the converted recordings in a folder.
pub fn measure(set: &Set, folder: &Path) -> Result<MeasuredSet, String> {
    let mut found = MeasuredSet::default();
    let results = each(set, folder, |path, recording| {
        let AnalyzedRecording { log, analysis, truth } = recording;
        let mut tallies = vec![(SHIPPED.to_string(), tally(&truth, analysis.found(), analysis.meta())?)];
        for method in &set.manifest.methods {
            let result = method.result(set, &log, analysis.found());
            let result = result.map_err(|error| format!("{}: {error}", path.display()))?;
            tallies.push((method.name.clone(), tally(&truth, &result, analysis.meta())?));
        }
        Ok(MeasuredRecording { log: path.to_path_buf(), tallies })
    })?;
    for result in results {
        match result {
            Ok(recording) => found.recordings.push(recording),
            Err(error) => found.errors.push(error),
        }
    }
    Ok(found)
}

/// What `of` returns for each converted recording in a folder, in the order of their paths.
pub fn each<T: Send>(
    set: &Set,
    folder: &Path,
    of: impl Fn(&Path, AnalyzedRecording) -> Result<T, String> + Sync,
) -> Result<Vec<Result<T, String>>, String> {
    let logs = teachtree_session::files::all_logs(&[folder.to_path_buf()]);
    let logs: Vec<PathBuf> = logs.map_err(|error| error.to_string())?;
    let map = NameMap::of_pairs(&set.map()).map_err(|error| error.to_string())?;
    Ok(logs.par_iter().map(|path| of(path, AnalyzedRecording::open(set, folder, &map, path)?)).collect())
}

fn tally(truth: &Truth, analysis: &Analysis, meta: &Meta) -> Result<Tally, String> {
    let rows = score::score(truth, analysis, Stage::Relabeled, meta).map_err(|error| error.to_string())?;
    let mut all = Tally::default();
    rows.iter().for_each(|row| all.add(&row.tally));
    Ok(all)
}
