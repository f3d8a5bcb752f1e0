//! A bag that is exported: the streams of its numbers, and its pictures.

use std::collections::BTreeSet;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_frames::raw_log::{self, RawLog, seconds_since};
use teachtree_frames::streams::{FARTHEST_S, Stream, Streams};
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::read::formats::lerobot::new_set::CAMERA;
use teachtree_logs::read::formats::picture_file;
use teachtree_logs::read::formats::picture_spool::{PictureSpool, SpooledPicture};
use teachtree_logs::read::formats::raw_topics::{RawBag, RawTopic};

/// Ends of the names of topics with pictures, which say how a picture is sent.
const ENDINGS: [&str; 6] = ["/compressed", "/image_raw", "/image_rect_raw", "/image_color", "/image_rect", "/image"];

/// A camera of a bag.
pub struct Camera {
    /// The name of its feature.
    pub name: String,
    /// Height, width and number of colors of its pictures.
    pub size: [usize; 3],
    /// When each picture was taken, s, in order, and where it is.
    shots: Vec<(f64, SpooledPicture)>,
}

impl Camera {
    /// Reads the pictures of a topic.
    fn new(topic: &str, of: &RawTopic<SpooledPicture>, origin_ns: i64) -> Result<Self, InputError> {
        let wrong = |message: String| InputError::new(topic, message);
        let mut shots = Vec::with_capacity(of.pictures.len());
        for (stamp, shot) in of.stamps_ns.iter().zip(&of.pictures) {
            let shot = shot.as_ref().map_err(|why| wrong(why.clone()))?;
            shots.push((seconds_since(origin_ns, *stamp), *shot));
        }
        shots.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let size = shots.first().map_or([0; 3], |(_, shot)| shot.size);
        if let Some((time, shot)) = shots.iter().find(|(_, shot)| shot.size != size) {
            let [[height, width, _], [h, w, _]] = [size, shot.size];
            return Err(wrong(format!("its pictures have {width} x {height} pixels, and {w} x {h} at {time:.3} s")));
        }
        Ok(Self { name: feature(topic), size, shots })
    }

    fn span(&self) -> Option<[f64; 2]> {
        self.shots.first().zip(self.shots.last()).map(|((first, _), (last, _))| [*first, *last])
    }

    /// The newest picture at a time; `None` where it is too old.
    pub fn at(&self, time_s: f64) -> Option<SpooledPicture> {
        let at = self.shots.partition_point(|(stamp, _)| *stamp <= time_s).checked_sub(1)?;
        let (stamp, shot) = self.shots.get(at)?;
        (time_s - stamp <= FARTHEST_S).then_some(*shot)
    }
}

/// The feature of a topic: `observation.images.wrist` of `/wrist/image_raw/compressed`.
fn feature(topic: &str) -> String {
    let mut name = topic;
    while let Some(rest) = ENDINGS.iter().find_map(|ending| name.strip_suffix(ending)).filter(|rest| rest.len() > 1) {
        name = rest;
    }
    format!("{CAMERA}{}", name.trim_matches('/').replace(['/', '.'], "_"))
}

/// A bag in memory, its pictures in a temporary file.
pub struct OpenBag {
    /// Its topics.
    pub log: RawLog,
    /// The stamp from which its times count, ns.
    pub origin_ns: i64,
    /// What becomes `observation.state` and `action`.
    pub state: Streams,
    /// None for a set without actions.
    pub action: Streams,
    /// Its cameras.
    pub cameras: Vec<Camera>,
    /// Their pictures.
    pub spool: PictureSpool,
}

/// What of a bag is exported.
#[derive(clap::Args, Clone)]
pub struct Choice {
    /// Columns of `observation.state`: `/joint_states` for all of a topic, `/joint_states.position` for some; by default positions of joints and poses
    #[arg(long, value_name = "COLUMNS")]
    state: Vec<String>,
    /// Columns of `action`, as for `--state`, or `next` for the state of the next frame; by default the set has no actions
    #[arg(long, value_name = "COLUMNS")]
    action: Vec<String>,
    /// Topics with images; by default all, `none` for none
    #[arg(long, value_name = "TOPIC")]
    camera: Vec<String>,
}

impl Choice {
    /// Whether actions are the states of the next frames.
    pub fn is_next_state(&self) -> bool {
        matches!(self.action.as_slice(), [only] if only == "next")
    }

    /// Opens a bag.
    ///
    /// # Errors
    /// The path is not a bag or is damaged, a column or topic that is chosen is not there, or a picture cannot be read.
    pub fn open(&self, path: &Path) -> Result<OpenBag, InputError> {
        let mut spool = PictureSpool::new()?;
        let has = |topic: &str| self.camera.is_empty() || self.camera.iter().any(|wanted| wanted == topic);
        let mut bag = RawBag::read(path, &AllowedFolders::default(), &mut |topic, picture| {
            if !has(topic) {
                return Ok(Err("it is not chosen".into()));
            }
            match picture_file::file(picture) {
                Ok(file) => match picture_file::size(&file) {
                    Some(size) => spool.add(&file, size).map(Ok),
                    None => Ok(Err("a picture has an alpha channel, or no declared size".into())),
                },
                Err(why) => Ok(Err(why)),
            }
        })?;
        // Which topic sends first differs between recordings.
        bag.topics.sort_keys();
        let log = raw_log::of_bag(&bag);
        let origin_ns = log.origin_ns.unwrap_or_default();
        let in_bag = |error: InputError| InputError { place: format!("{}: {}", path.display(), error.place), ..error };
        let action = match self.action.as_slice() {
            [] => Streams::default(),
            _ if self.is_next_state() => Streams::default(),
            wanted => Streams::chosen(&log, "--action", wanted).map_err(in_bag)?,
        };
        let state = match self.state.as_slice() {
            [] => Streams::places(&log, &action),
            wanted => Streams::chosen(&log, "--state", wanted).map_err(in_bag)?,
        };
        if state.is_empty() {
            let error = InputError::new(path.display().to_string(), "found no positions of joints and no poses");
            return Err(error.help("name the columns with `--state /TOPIC`; `teachtree inspect` lists them"));
        }
        let cameras = self.cameras(&bag, origin_ns).map_err(in_bag)?;
        Ok(OpenBag { log, origin_ns, state, action, cameras, spool })
    }

    fn cameras(&self, bag: &RawBag<SpooledPicture>, origin_ns: i64) -> Result<Vec<Camera>, InputError> {
        let with_pictures = || bag.topics.iter().filter(|(_, topic)| !topic.pictures.is_empty());
        let unknown =
            self.camera.iter().find(|wanted| *wanted != "none" && !with_pictures().any(|(topic, _)| topic == *wanted));
        if let Some(unknown) = unknown {
            let known: Vec<&str> = with_pictures().map(|(topic, _)| topic.as_str()).collect();
            let error = InputError::new("--camera", format!("no topic `{unknown}` has pictures"));
            let help =
                if known.is_empty() { "there is none".into() } else { format!("there are {}", known.join(", ")) };
            return Err(error.help(help));
        }
        let mut cameras = Vec::new();
        let mut names = BTreeSet::new();
        for (topic, of) in with_pictures() {
            if !self.camera.is_empty() && !self.camera.contains(topic) {
                continue;
            }
            let camera = Camera::new(topic, of, origin_ns)?;
            if !names.insert(camera.name.clone()) {
                let message = format!("two topics would be called `{}`", camera.name);
                return Err(InputError::new(topic, message).help("choose one of them with `--camera TOPIC`"));
            }
            cameras.push(camera);
        }
        Ok(cameras)
    }
}

impl OpenBag {
    /// The time in which all streams and cameras have begun and not ended yet, s.
    pub fn span(&self) -> [f64; 2] {
        let streams = self.state.iter().chain(self.action.iter()).filter_map(Stream::span);
        let spans = streams.chain(self.cameras.iter().filter_map(Camera::span));
        spans.fold([0.0, f64::INFINITY], |[from, to], [first, last]| [from.max(first), to.min(last)])
    }
}
