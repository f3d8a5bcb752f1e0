//! A recording in, the same one as it would be from another laboratory out: another rate, other sensors, another place, another hand.

use crate::kind::{Kind, Set};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_analysis::score::statistics::quantile;

/// Where a time of the original is in the variant: `pace · t + offset_s`, of what was recorded between `from_s` and `to_s` of the variant.
#[derive(Clone, Copy, Debug)]
pub struct Warp {
    pub pace: f64,
    pub offset_s: f64,
    pub from_s: f64,
    pub to_s: f64,
    /// Whether the other hand does it.
    pub other_hand: bool,
}

impl Warp {
    pub const NONE: Self =
        Self { pace: 1.0, offset_s: 0.0, from_s: f64::NEG_INFINITY, to_s: f64::INFINITY, other_hand: false };

    /// The time in the variant, s; `None` where it is not in it.
    pub fn of(&self, at_s: f64) -> Option<f64> {
        let at_s = self.pace * at_s + self.offset_s;
        (self.from_s..=self.to_s).contains(&at_s).then_some(at_s)
    }

    /// The same, at the next end where it is not in it.
    pub fn clamped(&self, at_s: f64) -> f64 {
        (self.pace * at_s + self.offset_s).clamp(self.from_s, self.to_s)
    }
}

#[derive(Clone, Debug)]
enum Cells {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

/// A file of a recording: its columns by title.
#[derive(Clone, Debug)]
struct Table {
    file: String,
    headed: bool,
    columns: Vec<(String, Cells)>,
}

/// A recording and its binding, to be changed.
#[derive(Clone, Debug)]
pub struct Lab {
    kind: Kind,
    tables: Vec<Table>,
    binding: String,
    warp: Warp,
    rng: ChaCha8Rng,
}

/// A variant: what it is called, and what it does; `false` where that cannot be done.
pub type Variant = (&'static str, fn(&mut Lab) -> bool);

/// Forces and places are changed one at a time: what breaks then has one reason.
pub const VARIANTS: [Variant; 31] = [
    ("as it is", |_| true),
    ("every second row", |lab| lab.keep_rows(|row, _| row % 2 == 0)),
    ("10 Hz", |lab| lab.keep_every(0.1)),
    ("one row in ten lost", |lab| lab.keep_rows(|row, rng| row == 0 || rng.random::<f64>() > 0.1)),
    ("stamps off by up to a quarter of a step", Lab::jitter),
    ("stamps counted from 1970", |lab| lab.retime(1.0, 1.7e9)),
    ("1.5 times as fast", |lab| lab.retime(1.0 / 1.5, 0.0)),
    ("1.5 times as slow", |lab| lab.retime(1.5, 0.0)),
    ("begins after a tenth", |lab| lab.cut(0.1, 1.0)),
    ("begins after a quarter", |lab| lab.cut(0.25, 1.0)),
    ("ends after three quarters", |lab| lab.cut(0.0, 0.75)),
    ("3 s of rest before and after", |lab| lab.rest(3.0)),
    ("positions with 1 mm of noise", |lab| lab.shake(0.001)),
    ("positions with 2 mm of noise", |lab| lab.shake(0.002)),
    ("positions in whole mm", Lab::rounded),
    ("rotations with 1° of noise", |lab| lab.wobble(1.0_f64.to_radians())),
    ("positions missing in one row of twenty", |lab| lab.drop_out(0.05)),
    ("forces with noise of 0.2 N", |lab| lab.noisy_forces(0.2)),
    ("forces × 0.3", |lab| lab.scale_forces(0.3)),
    ("forces × 3", |lab| lab.scale_forces(3.0)),
    ("wrist sensor with a bias of 3 N", |lab| lab.bias(3.0)),
    ("mirrored", Lab::mirror),
    ("turned by 50° and moved, with all fixtures", Lab::moved),
    ("the other hand", Lab::other_hand),
    ("other names of bodies", Lab::rename),
    ("no flags of the environment", |lab| lab.without(&|title| title.starts_with("C_") && of_environment(title))),
    ("no forces of the environment", |lab| lab.without(&|title| title.starts_with("F_") && of_environment(title))),
    ("flags of the fingers from the gripper's opening", Lab::by_opening),
    ("flags wrong in one row of a hundred", |lab| lab.flicker(0.01)),
    ("flags 50 ms late", |lab| lab.late_flags(0.05)),
    ("flags of the fingers lost for 100 ms once a second", |lab| lab.gaps(0.1)),
];

/// Whether a column of robosuite says what the table does.
fn of_environment(title: &str) -> bool {
    title.contains("_env") && !title.contains("_hand_")
}

impl Lab {
    /// Reads a recording; `None` where its format cannot be changed here.
    pub fn read(kind: Kind, path: &Path, root: &Path) -> Result<Option<Self>, String> {
        let said = |error: std::io::Error| format!("{}: {error}", path.display());
        let binding = root.join("demos").join(format!("{}.binding.yaml", kind.binding()));
        let mut binding = std::fs::read_to_string(binding).map_err(said)?;
        let mut tables = vec![];
        if kind.set() == Set::Snap {
            let titles: [&[&str]; 2] =
                [&["t", "fx", "fy", "fz", "tx", "ty", "tz"], &["t", "px", "py", "pz", "roll", "pitch", "yaw"]];
            for (file, titles) in ["R_Torques.dat", "R_CartPos.dat"].into_iter().zip(titles) {
                if !path.join(file).is_file() {
                    continue;
                }
                let text = std::fs::read_to_string(path.join(file)).map_err(said)?;
                let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
                tables.push(Table::of_rows(file.into(), false, titles.iter().map(ToString::to_string), &rows));
            }
            let states = std::fs::read_to_string(path.join("R_State.dat")).unwrap_or_default();
            let states: Vec<Vec<&str>> = states.lines().map(|line| vec![line]).collect();
            tables.push(Table::of_rows("R_State.dat".into(), false, ["state".to_string()], &states));
        } else {
            let text = std::fs::read_to_string(path).map_err(said)?;
            let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
            let Some(titles) = rows.next() else { return Ok(None) };
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let rows: Vec<_> = rows.collect();
            let mut table = Table::of_rows(name, true, titles.iter().map(ToString::to_string), &rows);
            if table.numbers("t").is_none() {
                let time = (0..rows.len()).map(|row| row as f64 * 0.01).collect();
                table.columns.push(("t".into(), Cells::Numbers(time)));
                binding = binding.replace("rate: 100 Hz", "time: t [s]\nresample: 100 Hz");
            }
            tables.push(table);
        }
        Ok(Some(Self { kind, tables, binding, warp: Warp::NONE, rng: ChaCha8Rng::seed_from_u64(7) }))
    }

    /// Writes the recording and its binding into a folder; returns their paths, and where its times are.
    pub fn write(&self, folder: &Path) -> Result<(PathBuf, PathBuf, Warp), String> {
        let said = |error: std::io::Error| error.to_string();
        for table in &self.tables {
            std::fs::write(folder.join(&table.file), table.text()).map_err(said)?;
        }
        let binding = folder.join("variant.binding.yaml");
        std::fs::write(&binding, &self.binding).map_err(said)?;
        let log = match self.tables.first() {
            Some(table) if table.headed => folder.join(&table.file),
            _ => folder.to_path_buf(),
        };
        let time = self.tables.first().and_then(|table| table.numbers("t")).unwrap_or_default();
        let (from_s, to_s) = (time.first().copied().unwrap_or_default(), time.last().copied().unwrap_or_default());
        Ok((log, binding, Warp { from_s, to_s, ..self.warp }))
    }

    /// The tables that have stamps.
    fn timed(&mut self) -> impl Iterator<Item = &mut Table> {
        self.tables.iter_mut().filter(|table| table.numbers("t").is_some())
    }

    /// Who has an uneven or slow log has it resampled, as the message says that refuses it.
    fn resampled(&mut self) {
        if !self.binding.contains("\nresample:") {
            self.binding.insert_str(0, "resample: 50 Hz\nbridge: 300 ms\n");
        }
    }

    fn keep_rows(&mut self, keep: impl Fn(usize, &mut ChaCha8Rng) -> bool) -> bool {
        let mut rng = self.rng.clone();
        self.resampled();
        self.timed().for_each(|table| {
            let kept: Vec<bool> = (0..table.rows()).map(|row| keep(row, &mut rng)).collect();
            table.retain(&kept);
        });
        true
    }

    fn keep_every(&mut self, step_s: f64) -> bool {
        let mut kept_any = false;
        self.resampled();
        self.timed().for_each(|table| {
            let time = table.numbers("t").unwrap_or_default();
            let mut next = f64::NEG_INFINITY;
            let kept: Vec<bool> = time
                .iter()
                .map(|at_s| {
                    let keep = *at_s >= next - 1e-6;
                    if keep {
                        next = if next.is_finite() { next + step_s } else { at_s + step_s };
                    }
                    keep
                })
                .collect();
            kept_any |= kept.iter().any(|kept| !kept);
            table.retain(&kept);
        });
        kept_any
    }

    fn jitter(&mut self) -> bool {
        let mut rng = self.rng.clone();
        self.resampled();
        self.timed().for_each(|table| {
            let Some(time) = table.numbers_mut("t") else { return };
            let step = (time.last().copied().unwrap_or(0.0) - time.first().copied().unwrap_or(0.0)) / time.len() as f64;
            let before = time.clone();
            for row in 1..time.len().saturating_sub(1) {
                let own = step.min(before[row] - before[row - 1]).min(before[row + 1] - before[row]);
                time[row] += rng.random_range(-0.25..=0.25) * own.max(0.0);
            }
        });
        true
    }

    fn retime(&mut self, pace: f64, offset_s: f64) -> bool {
        if self.kind.set() == Set::Snap && offset_s > 1e6 {
            return false; // the state files would have to count so too
        }
        if pace > 1.0 {
            self.resampled();
        }
        self.timed().for_each(|table| {
            for (title, cells) in &mut table.columns {
                let Cells::Numbers(values) = cells else { continue };
                match title.as_str() {
                    "t" => values.iter_mut().for_each(|value| *value = pace * *value + offset_s),
                    "vx" | "vy" | "vz" | "wx" | "wy" | "wz" => values.iter_mut().for_each(|value| *value /= pace),
                    _ => {}
                }
            }
        });
        (self.warp.pace, self.warp.offset_s) = (pace, offset_s);
        true
    }

    fn cut(&mut self, from: f64, to: f64) -> bool {
        let time = self.tables.first().and_then(|table| table.numbers("t")).unwrap_or_default();
        let (first, last) = (time.first().copied().unwrap_or_default(), time.last().copied().unwrap_or_default());
        let range = first + from * (last - first)..=first + to * (last - first);
        self.timed().for_each(|table| {
            let kept: Vec<bool> =
                table.numbers("t").unwrap_or_default().iter().map(|at_s| range.contains(at_s)).collect();
            table.retain(&kept);
        });
        true
    }

    /// The first row lasts longer, and the last one.
    fn rest(&mut self, rest_s: f64) -> bool {
        self.timed().for_each(|table| {
            let time = table.numbers("t").unwrap_or_default().to_vec();
            let (Some(&first), Some(&last)) = (time.first(), time.last()) else { return };
            let step = (last - first) / (time.len().max(2) - 1) as f64;
            let more = (rest_s / step) as usize;
            let rows: Vec<usize> = std::iter::repeat_n(0, more)
                .chain(0..time.len())
                .chain(std::iter::repeat_n(time.len() - 1, more))
                .collect();
            for (_, cells) in &mut table.columns {
                cells.pick(&rows);
            }
            if let Some(time) = table.numbers_mut("t") {
                for row in 0..more {
                    time[row] = first - (more - row) as f64 * step;
                    let end = time.len() - more + row;
                    time[end] = last + (row + 1) as f64 * step;
                }
            }
        });
        true
    }

    fn normal(&mut self, sigma: f64) -> impl FnMut() -> f64 + use<> {
        let mut rng = self.rng.clone();
        let normal = Normal::new(0.0, sigma).ok();
        move || normal.map_or(0.0, |normal| normal.sample(&mut rng))
    }

    fn each(&mut self, of: impl Fn(&str) -> bool, mut change: impl FnMut(&mut f64)) -> bool {
        let mut any = false;
        for (title, cells) in self.tables.iter_mut().flat_map(|table| &mut table.columns) {
            if let (true, Cells::Numbers(values)) = (of(title), cells) {
                values.iter_mut().for_each(&mut change);
                any = true;
            }
        }
        any
    }

    fn shake(&mut self, sigma: f64) -> bool {
        let mut normal = self.normal(sigma);
        self.each(is_position, |value| *value += normal())
    }

    fn rounded(&mut self) -> bool {
        self.each(is_position, |value| *value = (*value * 1000.0).round() / 1000.0)
    }

    fn wobble(&mut self, sigma: f64) -> bool {
        let mut normal = self.normal(sigma / 2.0);
        self.vectors(&["qw", "qx", "qy", "qz"], |q| {
            let turn = [1.0, normal(), normal(), normal()];
            let turned = product(turn, [q[0], q[1], q[2], q[3]]);
            let norm = turned.iter().map(|value| value * value).sum::<f64>().sqrt().max(1e-9);
            q.iter_mut().zip(turned).for_each(|(value, turned)| *value = turned / norm);
        })
    }

    fn drop_out(&mut self, share: f64) -> bool {
        let mut rng = self.rng.clone();
        let mut any = false;
        for table in &mut self.tables {
            let lost: Vec<bool> =
                (0..table.rows()).map(|row| row > 0 && row + 1 < table.rows() && rng.random::<f64>() < share).collect();
            for (title, cells) in &mut table.columns {
                if let (true, Cells::Numbers(values)) = (is_position(title), cells) {
                    values.iter_mut().zip(&lost).filter(|(_, lost)| **lost).for_each(|(value, _)| *value = f64::NAN);
                    any = true;
                }
            }
        }
        any
    }

    fn noisy_forces(&mut self, sigma: f64) -> bool {
        // What a solver computes between two bodies has no sensor.
        let mut normal = self.normal(sigma);
        self.each(is_wrist_force, |value| *value += normal())
    }

    fn scale_forces(&mut self, by: f64) -> bool {
        self.each(|title| is_wrist_force(title) || title.starts_with("F_"), |value| *value *= by)
    }

    fn bias(&mut self, newtons: f64) -> bool {
        self.each(is_wrist_force, |value| *value += newtons / 3.0_f64.sqrt())
    }

    /// Changes the vectors whose components end in these, components together.
    fn vectors(&mut self, ends: &[&str], mut change: impl FnMut(&mut [f64])) -> bool {
        let mut any = false;
        for table in &mut self.tables {
            let stems: Vec<String> = table
                .columns
                .iter()
                .filter_map(|(title, _)| title.strip_suffix(ends[0]).filter(|stem| is_stem(stem)).map(str::to_string))
                .collect();
            for stem in stems {
                let names: Vec<String> = ends.iter().map(|end| format!("{stem}{end}")).collect();
                if names.iter().any(|name| table.numbers(name).is_none()) {
                    continue;
                }
                any = true;
                for row in 0..table.rows() {
                    let mut vector: Vec<f64> =
                        names.iter().map(|name| table.numbers(name).map_or(f64::NAN, |it| it[row])).collect();
                    change(&mut vector);
                    for (name, value) in names.iter().zip(vector) {
                        if let Some(values) = table.numbers_mut(name) {
                            values[row] = value;
                        }
                    }
                }
            }
        }
        any
    }

    /// The world forces of robosuite: `F_a_b_x`.
    fn world_forces(&mut self, mut change: impl FnMut(&mut [f64])) {
        self.vectors(&["_x", "_y", "_z"], |vector| change(vector));
    }

    /// The places of fixtures in the scene of the binding, with lengths in m or mm.
    fn fixtures(&mut self, change: impl Fn([f64; 3]) -> [f64; 3]) {
        let mut text = String::new();
        for line in self.binding.lines() {
            let changed = line.split_once("position: [").and_then(|(before, rest)| {
                let (inside, after) = rest.split_once(']')?;
                let mut lengths = inside.split(',').map(|length| {
                    let (number, unit) = length.trim().split_once(' ')?;
                    Some(number.parse::<f64>().ok()? * if unit == "mm" { 0.001 } else { 1.0 })
                });
                let at = change([lengths.next()??, lengths.next()??, lengths.next()??]);
                Some(format!("{before}position: [{} m, {} m, {} m]{after}", at[0], at[1], at[2]))
            });
            text.push_str(changed.as_deref().unwrap_or(line));
            text.push('\n');
        }
        self.binding = text;
    }

    fn mirror(&mut self) -> bool {
        if self.kind == Kind::Door {
            return false; // the bearing's place on the door would have to be mirrored too
        }
        self.vectors(&["px", "py", "pz"], |p| p[1] = -p[1]);
        self.vectors(&["qw", "qx", "qy", "qz"], |q| (q[1], q[3]) = (-q[1], -q[3]));
        self.vectors(&["roll", "pitch", "yaw"], |it| (it[0], it[2]) = (-it[0], -it[2]));
        self.vectors(&["vx", "vy", "vz"], |v| v[1] = -v[1]);
        self.vectors(&["wx", "wy", "wz"], |w| (w[0], w[2]) = (-w[0], -w[2]));
        self.world_forces(|f| f[1] = -f[1]);
        self.fixtures(|[x, y, z]| [x, -y, z]);
        true
    }

    fn moved(&mut self) -> bool {
        let (sin, cos) = 50.0_f64.to_radians().sin_cos();
        let turned = move |v: &mut [f64]| (v[0], v[1]) = (cos * v[0] - sin * v[1], sin * v[0] + cos * v[1]);
        // DESK's rules know the height of the board.
        let shift = [0.5, -0.3, if self.kind.set() == Set::Desk { 0.0 } else { 0.2 }];
        self.vectors(&["px", "py", "pz"], |p| {
            turned(p);
            p.iter_mut().zip(shift).for_each(|(value, shift)| *value += shift);
        });
        let half = 25.0_f64.to_radians();
        self.vectors(&["qw", "qx", "qy", "qz"], |q| {
            let by = product([half.cos(), 0.0, 0.0, half.sin()], [q[0], q[1], q[2], q[3]]);
            q.copy_from_slice(&by);
        });
        self.vectors(&["roll", "pitch", "yaw"], |it| it[2] += 2.0 * half);
        self.vectors(&["vx", "vy", "vz"], turned);
        self.vectors(&["wx", "wy", "wz"], turned);
        self.world_forces(turned);
        // A place that is found by the log counts from there.
        let by = if self.binding.contains("\nplaces:") { [0.0; 3] } else { shift };
        self.fixtures(|[x, y, z]| [cos * x - sin * y + by[0], sin * x + cos * y + by[1], z + by[2]]);
        true
    }

    fn other_hand(&mut self) -> bool {
        if self.kind.set() == Set::Desk || self.binding.contains("left.") {
            return false; // the gold of these recordings names the arms, but the rules do not distinguish which arm gives
        }
        self.binding = self.binding.replace("right", "left");
        self.warp.other_hand = true;
        true
    }

    fn rename(&mut self) -> bool {
        let bodies: Vec<String> = self
            .binding
            .lines()
            .skip_while(|line| !line.starts_with("  bodies:"))
            .filter_map(|line| line.strip_prefix("    ")?.split_once(':').map(|(name, _)| name.to_string()))
            .filter(|name| !name.is_empty() && !name.starts_with([' ', '#']) && name != "env")
            .collect();
        // The order of the names is reversed: ties must not be broken by it.
        let names: Vec<(String, String)> = bodies
            .iter()
            .enumerate()
            .map(|(index, name)| (name.clone(), format!("{}thing{index}", (b'z' - index as u8) as char)))
            .collect();
        for (title, _) in self.tables.iter_mut().flat_map(|table| &mut table.columns) {
            let parts: Vec<&str> =
                title.split('_').map(|part| names.iter().find(|it| it.0 == part).map_or(part, |it| &it.1)).collect();
            *title = parts.join("_");
        }
        let mut text = String::new();
        let mut word = String::new();
        for sign in self.binding.chars().chain(['\n']) {
            if sign.is_ascii_alphanumeric() {
                word.push(sign);
                continue;
            }
            text.push_str(names.iter().find(|it| it.0 == word).map_or(&word, |it| &it.1));
            word.clear();
            text.push(sign);
        }
        self.binding = text;
        !names.is_empty()
    }

    /// Takes columns out of the log, and the lines that bind them out of the binding.
    fn without(&mut self, gone: &dyn Fn(&str) -> bool) -> bool {
        if !self.tables.iter().flat_map(|table| &table.columns).any(|(title, _)| gone(title)) {
            return false;
        }
        self.tables.iter_mut().for_each(|table| table.columns.retain(|(title, _)| !gone(title)));
        let bound = |line: &str| {
            let pattern =
                line.split_once(": ").map_or("", |(_, pattern)| pattern.split_whitespace().next().unwrap_or(""));
            let pattern = pattern.trim_start_matches('-').replace("<object>", "thing").replace("<other>", "env2");
            gone(&pattern.replace("<xyz>", "x"))
        };
        self.binding = self.binding.lines().filter(|line| !bound(line)).fold(String::new(), |mut text, line| {
            let _ = writeln!(text, "{line}");
            text
        });
        self.kind.set() != Set::Wipe
    }

    /// The gripper is closed where its opening is below the middle of what occurs; the fingers have no flags.
    fn by_opening(&mut self) -> bool {
        if !matches!(self.kind.set(), Set::OneArm | Set::HandOver) {
            return false;
        }
        let opening = self.tables.first().and_then(|table| table.numbers("R_opening")).unwrap_or_default();
        let mut sorted = opening.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| quantile(&sorted, share).unwrap_or_default();
        let limit = f64::midpoint(at(0.02), at(0.98)) * 1000.0;
        let finger = |line: &&str| {
            !["thumb", "index", "palm"].iter().any(|finger| {
                line.contains(&format!(".{finger}.contact")) || line.contains(&format!(".{finger}.force"))
            })
        };
        let mut text = String::new();
        for line in self.binding.lines().filter(finger) {
            let _ = writeln!(text, "{}", line.replace("hand_flags.rules", "hand_gripper.rules"));
            for (side, letter) in [("right", "R"), ("left", "L")] {
                if line.contains(&format!("{side}.gripper.opening:")) {
                    let _ = writeln!(text, "  {side}.gripper.closed: {letter}_opening [m] < {limit} mm");
                }
            }
        }
        self.binding = text;
        true
    }

    fn flicker(&mut self, share: f64) -> bool {
        let mut rng = self.rng.clone();
        self.each(
            |title| title.starts_with("C_"),
            |value| {
                if rng.random::<f64>() < share {
                    *value = 1.0 - *value;
                }
            },
        )
    }

    fn late_flags(&mut self, late_s: f64) -> bool {
        let mut any = false;
        for table in &mut self.tables {
            let time = table.numbers("t").unwrap_or_default().to_vec();
            for (title, cells) in &mut table.columns {
                if let (true, Cells::Numbers(values)) = (title.starts_with("C_"), cells) {
                    let before = values.clone();
                    for (row, value) in values.iter_mut().enumerate() {
                        let source = time.partition_point(|at_s| *at_s <= time[row] - late_s + 1e-9).saturating_sub(1);
                        *value = before[source];
                    }
                    any = true;
                }
            }
        }
        any
    }

    fn gaps(&mut self, gap_s: f64) -> bool {
        let mut any = false;
        for table in &mut self.tables {
            let time = table.numbers("t").unwrap_or_default().to_vec();
            for (title, cells) in &mut table.columns {
                let of_finger = title.starts_with("C_R_f") || title.starts_with("C_L_f");
                if let (true, Cells::Numbers(values)) = (of_finger, cells) {
                    values
                        .iter_mut()
                        .zip(&time)
                        .filter(|(_, at_s)| at_s.rem_euclid(1.0) < gap_s)
                        .for_each(|(value, _)| *value = 0.0);
                    any = true;
                }
            }
        }
        any
    }
}

impl Table {
    fn of_rows(file: String, headed: bool, titles: impl IntoIterator<Item = String>, rows: &[Vec<&str>]) -> Self {
        let columns = titles
            .into_iter()
            .enumerate()
            .map(|(index, title)| {
                let texts: Vec<&str> = rows.iter().map(|row| row.get(index).copied().unwrap_or("").trim()).collect();
                let numbers: Option<Vec<f64>> = texts.iter().map(|text| text.parse().ok()).collect();
                let cells = numbers
                    .map_or_else(|| Cells::Texts(texts.iter().map(ToString::to_string).collect()), Cells::Numbers);
                (title, cells)
            })
            .collect();
        Self { file, headed, columns }
    }

    fn numbers(&self, title: &str) -> Option<&[f64]> {
        self.columns.iter().find(|(own, _)| own == title).and_then(|(_, cells)| match cells {
            Cells::Numbers(values) => Some(values.as_slice()),
            Cells::Texts(_) => None,
        })
    }

    fn numbers_mut(&mut self, title: &str) -> Option<&mut Vec<f64>> {
        self.columns.iter_mut().find(|(own, _)| own == title).and_then(|(_, cells)| match cells {
            Cells::Numbers(values) => Some(values),
            Cells::Texts(_) => None,
        })
    }

    fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, cells)| cells.len())
    }

    fn retain(&mut self, kept: &[bool]) {
        let rows: Vec<usize> = (0..kept.len()).filter(|row| kept[*row]).collect();
        self.columns.iter_mut().for_each(|(_, cells)| cells.pick(&rows));
    }

    fn text(&self) -> String {
        let mut text = String::new();
        let between = if self.headed { "," } else { "\t" };
        if self.headed {
            let titles: Vec<&str> = self.columns.iter().map(|(title, _)| title.as_str()).collect();
            let _ = writeln!(text, "{}", titles.join(between));
        }
        for row in 0..self.rows() {
            let cells: Vec<String> = self.columns.iter().map(|(_, cells)| cells.cell(row, self.headed)).collect();
            let _ = writeln!(text, "{}", cells.join(between));
        }
        text
    }
}

impl Cells {
    const fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Texts(texts) => texts.len(),
        }
    }

    fn pick(&mut self, rows: &[usize]) {
        match self {
            Self::Numbers(values) => *values = rows.iter().map(|row| values[*row]).collect(),
            Self::Texts(texts) => *texts = rows.iter().map(|row| texts[*row].clone()).collect(),
        }
    }

    fn cell(&self, row: usize, may_be_empty: bool) -> String {
        match self {
            Self::Numbers(values) if values[row].is_nan() => String::from(if may_be_empty { "" } else { "nan" }),
            Self::Numbers(values) => values[row].to_string(),
            Self::Texts(texts) => texts[row].clone(),
        }
    }
}

/// What stands before the component in a title.
fn is_stem(stem: &str) -> bool {
    stem.is_empty() || stem.ends_with('_') || stem.starts_with("F_")
}

fn is_position(title: &str) -> bool {
    ["px", "py", "pz"].iter().any(|end| title.strip_suffix(end).is_some_and(is_stem))
}

/// The forces of a sensor at a wrist.
fn is_wrist_force(title: &str) -> bool {
    ["fx", "fy", "fz"].iter().any(|end| title.strip_suffix(end).is_some_and(is_stem))
        || title.starts_with("F_R_hand_env")
}

fn product([a, b, c, d]: [f64; 4], [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}
