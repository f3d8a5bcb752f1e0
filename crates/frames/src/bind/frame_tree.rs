//! The frames of a log: transforms between them, as in topics such as `/tf`, and the frames in which poses are expressed.
//!
//! A transform has the name of its parent frame (`header.frame_id`, `parent_frame_id`), that of its child, and the pose of the child in the parent.

use super::header::{BoundColumn, Header};
use std::collections::BTreeSet;
use teachtree_base::channels::Shape;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::units::Dimension;
use teachtree_logs::read::table::Source;

/// Fields with the name of the frame in which a message stands, after its path.
const FRAME: [&str; 3] = ["header.frame_id", "parent_frame_id", "frame_id"];
/// The fields of a transform's position and rotation: in ROS, and in Foxglove's schemas.
const PARTS: [[&str; 2]; 2] = [["transform.translation", "transform.rotation"], ["translation", "rotation"]];

/// Maximum number of different names of a column that are distinguished; more than one is an error.
pub const MOST_NAMES: usize = 2;

/// The frames of a log.
#[derive(Default)]
pub struct FrameTree {
    transforms: Vec<Transform>,
    /// The texts of the columns that name frames, by column: at most [`MOST_NAMES`].
    texts: Vec<(usize, Vec<String>)>,
}

/// A transform of a log.
pub struct Transform {
    /// Its path in the log.
    pub title: String,
    /// The parent frame, or two of them where it changes.
    parents: Vec<String>,
    child: String,
    /// The columns of x, y and z of the child in the parent, m.
    pub position: [usize; 3],
    /// The columns of the rotation parent_from_child: w, x, y, z.
    pub rotation: [usize; 4],
}

/// A bound pose and its frame.
pub struct FramedPose {
    /// The position or rotation.
    pub channel: String,
    /// Whether it is a position.
    pub is_position: bool,
    /// The frame, or two of them where it changes.
    pub frames: Vec<String>,
    /// Whether each of its components is a column with its own sign.
    pub is_plain: bool,
}

impl FrameTree {
    /// The frames of a log in memory; of other logs none are known.
    pub fn of(source: &Source, header: &Header) -> Self {
        let sheets = source.sheets.iter();
        let columns: Vec<_> =
            sheets.flat_map(|sheet| (0..sheet.header.len()).map(move |column| (sheet, column))).collect();
        Self::new(header, |at| {
            columns.get(at).map_or_else(Vec::new, |(sheet, column)| sheet.rows.distinct_texts(*column, MOST_NAMES))
        })
    }

    /// The frames of a log; `texts` returns up to [`MOST_NAMES`] different texts of a column.
    pub fn new(header: &Header, texts: impl Fn(usize) -> Vec<String>) -> Self {
        let columns = (0..header.titles.len()).filter(|at| names_frame(header.title(*at)));
        let named = columns.map(|at| {
            let frames = texts(at).iter().map(|frame| frame.trim_start_matches('/').to_string()).collect::<Vec<_>>();
            (at, frames)
        });
        let mut tree = Self { transforms: vec![], texts: named.filter(|(_, frames)| !frames.is_empty()).collect() };
        tree.transforms = tree.texts.iter().filter_map(|(at, parents)| tree.transform(header, *at, parents)).collect();
        tree
    }

    /// The transform whose parent frame is in this column.
    fn transform(&self, header: &Header, at: usize, parents: &[String]) -> Option<Transform> {
        let name = header.title(at);
        let path = FRAME.iter().find_map(|frame| name.strip_suffix(frame)?.strip_suffix('.'))?;
        let column = |name: String| header.find(&name, None).ok().flatten();
        let child = match column(format!("{path}.child_frame_id")).and_then(|at| self.texts_of(at)) {
            Some([child]) => child.clone(),
            Some(_) => return None,
            // An element of an array by its name.
            None => path.rsplit_once("transforms.")?.1.trim_start_matches('/').to_string(),
        };
        PARTS.iter().find_map(|[position, rotation]| {
            let position = ["x", "y", "z"].map(|letter| column(format!("{path}.{position}.{letter}")));
            let rotation = ["w", "x", "y", "z"].map(|letter| column(format!("{path}.{rotation}.{letter}")));
            let [x, y, z] = position;
            let [w, i, j, k] = rotation;
            let (position, rotation) = ([x?, y?, z?], [w?, i?, j?, k?]);
            Some(Transform { title: path.into(), parents: parents.to_vec(), child: child.clone(), position, rotation })
        })
    }

    fn texts_of(&self, column: usize) -> Option<&[String]> {
        self.texts.iter().find(|(at, _)| *at == column).map(|(_, texts)| texts.as_slice())
    }

    /// The bound poses whose frame the log names.
    pub fn poses(&self, bound: &[BoundColumn], header: &Header) -> Vec<FramedPose> {
        let mut poses = vec![];
        for group in bound.chunk_by(|one, next| one.channel == next.channel) {
            let Some(first) = group.first() else { continue };
            let shape = LogChannel::parse(&first.channel).map(|channel| (channel.shape(), channel.dimension()));
            let is_position = match shape {
                Some((Shape::Vec3, Dimension::LENGTH)) if first.channel.ends_with(".position") => true,
                Some((Shape::Rotation, _)) => false,
                _ => continue,
            };
            let column = first.terms.iter().find_map(|term| term.column);
            let Some(frames) = column.and_then(|column| self.frame(header.title(column), header)) else { continue };
            let is_plain =
                group.iter().flat_map(|part| &part.terms).all(|term| term.column.is_some() && term.factor > 0.0);
            poses.push(FramedPose { channel: first.channel.clone(), is_position, frames: frames.to_vec(), is_plain });
        }
        poses
    }

    /// The frame of the message or element with this column.
    fn frame(&self, title: &str, header: &Header) -> Option<&[String]> {
        let ends = title.rmatch_indices('.').map(|(at, _)| at).chain([0]);
        let mut paths = ends.filter_map(|end| title.get(..end));
        paths.find_map(|path| {
            let column = |frame: &&str| {
                let name = if path.is_empty() { (*frame).to_string() } else { format!("{path}.{frame}") };
                header.find(&name, None).ok().flatten()
            };
            FRAME.iter().find_map(column).and_then(|column| self.texts_of(column))
        })
    }

    /// The frame itself, its parent, and so on up to the root.
    fn ancestors<'a>(&'a self, frame: &'a str) -> Vec<&'a str> {
        let mut found = vec![frame];
        while let Some(parent) = found.last().and_then(|last| self.above(last)?.parents.first())
            && !found.contains(&parent.as_str())
        {
            found.push(parent);
        }
        found
    }

    fn above(&self, child: &str) -> Option<&Transform> {
        self.transforms.iter().find(|transform| transform.child == child)
    }

    /// The nearest frame on which all these frames hang.
    pub fn common<'a>(&'a self, frames: &BTreeSet<&'a str>) -> Option<&'a str> {
        let mut frames = frames.iter();
        let first = self.ancestors(frames.next()?);
        let others: Vec<Vec<&str>> = frames.map(|frame| self.ancestors(frame)).collect();
        first.into_iter().find(|frame| others.iter().all(|other| other.contains(frame)))
    }

    /// The transforms from a frame up to another one, the nearest to the first frame first; none if it does not hang there.
    ///
    /// # Errors
    /// A transform whose parent changes.
    pub fn chain(&self, from: &str, to: &str) -> Result<Option<Vec<&Transform>>, String> {
        let mut chain = vec![];
        for frame in self.ancestors(from) {
            if frame == to {
                return Ok(Some(chain));
            }
            let Some(transform) = self.above(frame) else { break };
            if let [one, other] = transform.parents.as_slice() {
                return Err(format!("the parent of `{}` changes from `{one}` to `{other}`", transform.title));
            }
            chain.push(transform);
        }
        Ok(None)
    }

    /// Whether the log has transforms.
    pub fn is_empty(&self) -> bool {
        self.transforms.is_empty()
    }
}

/// Whether a column of this name has the names of frames.
pub fn names_frame(title: &str) -> bool {
    FRAME.iter().any(|frame| ends_with(title, frame)) || ends_with(title, "child_frame_id")
}

/// Whether a name is this field, or has it as its last part.
fn ends_with(name: &str, field: &str) -> bool {
    name.strip_suffix(field).is_some_and(|path| path.is_empty() || path.ends_with('.'))
}
