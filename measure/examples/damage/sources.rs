//! The recordings that are damaged: those that come with the project, and shipped demonstrations written in every format.

use crate::alteration::{self, DamagedFile, FileForm, Random, Table};
use crate::writers;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree::{Error, Log};
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

/// Recordings of `demos` and their bindings.
const DEMOS: &[(&str, &str, &str)] = &[
    ("CSV, foreign", "robosuite/lift_demo_1.csv", "robosuite/panda_lift"),
    ("CSV, foreign", "robosuite/nut_assembly_panda_demo_1.csv", "robosuite/panda_nut_assembly"),
    ("CSV, foreign", "robosuite/stack_panda_demo_1.csv", "robosuite/panda_stack"),
    ("CSV, foreign", "robosuite/SawyerLift_demo_1.csv", "robosuite/sawyer_lift"),
    ("CSV, foreign", "robosuite/BaxterPegInHole_demo_1.csv", "robosuite/baxter_peg_in_hole"),
    ("CSV, foreign", "robosuite/handover_panda_panda_demo_5.csv", "robosuite/handover"),
    ("CSV, foreign", "robosuite/door_panda_demo_1.csv", "robosuite/door"),
    ("CSV, foreign", "robosuite/wipe_panda_demo_1.csv", "robosuite/wipe"),
    ("CSV, foreign", "dapg_door/door_00.csv", "bindings/dapg_door"),
    ("Qualisys TSV", "dfki_hand/recording_excerpt.tsv", "bindings/dfki_hand"),
    ("HDF5", "robosuite/lift.hdf5", "robosuite/lift_hdf5"),
];

/// Shipped demonstrations that are written in each format.
const TAUGHT: [&str; 4] = ["pick_and_place", "peg_in_hole", "turn_screw", "push"];

/// The topic of bags, and the name of the array.
pub const TOPIC: &str = "log";

/// A recording that is damaged.
pub struct Source {
    pub format: &'static str,
    pub name: String,
    pub path: PathBuf,
    binding: Option<PathBuf>,
    scene: Option<PathBuf>,
    /// Which recording of the file it is.
    episode: &'static str,
    form: FileForm,
    /// Its cells, where they can be changed one by one.
    table: Option<Table>,
    bytes: Vec<u8>,
}

impl Source {
    pub fn open(&self, path: &Path) -> Result<Log, Error> {
        let mut options = Log::options();
        if let Some(binding) = &self.binding {
            options = options.binding(binding);
        }
        if let Some(scene) = &self.scene {
            options = options.scene(scene);
        }
        options.open(format!("{}{}", path.display(), self.episode))
    }

    pub fn file_name(&self) -> PathBuf {
        self.path.file_name().unwrap_or_default().into()
    }

    pub fn rows(&self) -> usize {
        self.table.as_ref().map_or(0, |table| table.rows.len())
    }

    /// Damages a copy; `None` where what was drawn changes nothing, or is of another kind.
    pub fn alter(&self, random: &mut Random, kind: &str) -> Option<DamagedFile> {
        let altered = match &self.table {
            Some(table) if !alteration::aims_at_bytes(random, &self.form) => {
                alteration::cells(random, table, |table| self.form.bytes(table))
            }
            _ => alteration::bytes(random, &self.bytes, &self.form),
        };
        altered.filter(|altered| altered.bytes != self.bytes && altered.kind.contains(kind))
    }
}

/// All recordings; what is written for them is in `folder`.
pub fn all(folder: &Path) -> Result<Vec<Source>, String> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("demos");
    let mut sources = Vec::new();
    for (format, log, binding) in DEMOS {
        let path = root.join(log);
        let bytes = std::fs::read(&path).map_err(|error| error.to_string())?;
        let text = String::from_utf8(bytes.clone()).ok();
        let form = match (path.extension().and_then(|it| it.to_str()), &text) {
            (Some("csv"), Some(text)) => FileForm::Delimited { delimiter: ',', preamble: preamble(text, ',') },
            (Some("tsv"), Some(text)) => FileForm::Delimited { delimiter: '\t', preamble: preamble(text, '\t') },
            _ => FileForm::Bytes,
        };
        sources.push(Source {
            format,
            name: formats_stem(log),
            binding: Some(root.join(format!("{binding}.binding.yaml"))),
            scene: None,
            episode: if *format == "HDF5" { "#demo_1" } else { "" },
            table: text.as_deref().and_then(|text| form.table(text)),
            path,
            form,
            bytes,
        });
    }
    for name in TAUGHT {
        sources.append(&mut taught(name, folder).map_err(|error| format!("{name}: {error}"))?);
    }
    Ok(sources)
}

fn formats_stem(log: &str) -> String {
    Path::new(log).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The lines above the titles.
fn preamble(text: &str, delimiter: char) -> Vec<String> {
    let is_row = |line: &str| line.split(delimiter).next().is_some_and(|cell| cell.trim().parse::<f64>().is_ok());
    let titles = text.lines().position(is_row).unwrap_or(1).saturating_sub(1);
    text.lines().take(titles).map(str::to_string).collect()
}

/// A shipped demonstration in every format.
fn taught(name: &str, folder: &Path) -> Result<Vec<Source>, Box<dyn std::error::Error>> {
    let mut recording = teach(&shipped::scene(name)?, &shipped::operator(name)?, 1)?;
    recording.labels.clear();
    recording.events.clear();
    let folder = folder.join(name);
    std::fs::create_dir_all(&folder)?;
    let csv = folder.join("log.csv");
    formats::write(&recording, &csv)?;
    let scene = folder.join("log.scene.yaml");
    let plain = FileForm::Delimited { delimiter: ',', preamble: Vec::new() };
    let titled = plain.table(&std::fs::read_to_string(&csv)?).ok_or("no table")?;
    // Units are those of SI, which other formats do not repeat.
    let name_of = |title: &String| title.split(" [").next().unwrap_or_default().to_string();
    let table = Table { titles: titled.titles.iter().map(name_of).collect(), rows: titled.rows.clone() };
    let [topic, fields] = ["topic", "fields"].map(|name| folder.join(format!("{name}.binding.yaml")));
    std::fs::write(&topic, binding(&table, "."))?;
    std::fs::write(&fields, binding(&table, writers::BETWEEN))?;
    let forms = [
        ("CSV", "log.csv", plain, None),
        ("JSON lines", "log.jsonl", FileForm::JsonLines, None),
        ("Parquet", "log.parquet", FileForm::Parquet(Box::new(recording)), None),
        ("MCAP", "log.mcap", FileForm::Mcap, Some(topic)),
        ("NPY", "log.npy", FileForm::Npy, None),
        ("NPZ", "log.npz", FileForm::Npz, None),
        ("ROS 1 bag", "log.bag", FileForm::Bag, Some(fields)),
        ("Zarr", "log.zarr.zip", FileForm::Zarr, None),
    ];
    let mut sources = Vec::new();
    for (format, file, form, binding) in forms {
        let path = folder.join(file);
        let table = if format == "CSV" { &titled } else { &table };
        let bytes = form.bytes(table).ok_or_else(|| format!("no {format}"))?;
        std::fs::write(&path, &bytes)?;
        let (table, scene) = (Some(table.clone()), Some(scene.clone()));
        sources.push(Source { format, name: name.into(), path, binding, scene, episode: "", form, table, bytes });
    }
    Ok(sources)
}

/// A binding that takes the columns of a topic by their names, in which `between` stands for each point.
fn binding(table: &Table, between: &str) -> String {
    let mut text = format!("time: {TOPIC}.time\nchannels:\n");
    let field = |name: &str| format!("{TOPIC}.{}", name.replace('.', between));
    for title in table.titles.iter().filter(|title| title.as_str() != "time") {
        // Each vector is named once, by its first component.
        match title.rsplit_once('.') {
            Some((channel, "x")) if table.titles.contains(&format!("{channel}.w")) => {}
            Some((channel, "x")) => _ = writeln!(text, "  {channel}: {}{between}<xyz>", field(channel)),
            Some((channel, "w")) => _ = writeln!(text, "  {channel}: {}{between}<wxyz>", field(channel)),
            Some((_, "y" | "z")) => {}
            _ => _ = writeln!(text, "  {title}: {}", field(title)),
        }
    }
    text
}

impl FileForm {
    /// The cells of a text; `None` where it has other rows.
    pub fn table(&self, text: &str) -> Option<Table> {
        let Self::Delimited { delimiter, preamble } = self else { return None };
        let split = |line: &str| line.split(*delimiter).map(str::to_string).collect::<Vec<_>>();
        let mut lines = text.lines().skip(preamble.len());
        let titles = split(lines.next()?);
        let rows: Vec<Vec<String>> = lines.map(split).collect();
        rows.iter().all(|row| row.len() == titles.len()).then_some(Table { titles, rows })
    }

    /// The file with these cells.
    pub fn bytes(&self, table: &Table) -> Option<Vec<u8>> {
        match self {
            Self::Delimited { delimiter, preamble } => {
                let delimiter = delimiter.to_string();
                let rows = std::iter::once(&table.titles).chain(&table.rows).map(|row| row.join(&delimiter));
                let lines: Vec<String> = preamble.iter().cloned().chain(rows).collect();
                Some((lines.join("\n") + "\n").into_bytes())
            }
            Self::JsonLines => Some(writers::lines(table)),
            Self::Parquet(plain) => writers::parquet(plain, table),
            Self::Mcap => writers::mcap(table),
            Self::Npy => Some(writers::npy(table)),
            Self::Npz => writers::zip([(format!("{TOPIC}.npy"), writers::npy(table))]),
            Self::Zarr => writers::zip(writers::zarr(table)),
            Self::Bag => Some(writers::bag(table)),
            Self::Bytes => None,
        }
    }
}
