//! Messages of ROS 2 in CDR, and the definitions of their types.

/// The type of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ros2Type {
    /// `std_msgs/msg/String`.
    Text,
    /// `std_msgs/msg/Float64`.
    Number,
    /// `tf2_msgs/msg/TFMessage`.
    Poses,
}

impl Ros2Type {
    pub(super) const ALL: [Self; 3] = [Self::Text, Self::Number, Self::Poses];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Text => "std_msgs/msg/String",
            Self::Number => "std_msgs/msg/Float64",
            Self::Poses => "tf2_msgs/msg/TFMessage",
        }
    }

    /// The text that defines it.
    pub const fn definition(self) -> &'static str {
        match self {
            Self::Text => "string data\n",
            Self::Number => "float64 data\n",
            Self::Poses => POSES,
        }
    }
}

/// The definition of `TFMessage` with all that it is made of.
const POSES: &str = "geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
";

/// A message that is being written in CDR, little endian: numbers stand at multiples of their size.
#[derive(Default)]
pub struct Cdr(Vec<u8>);

impl Cdr {
    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        self.0.resize(self.0.len().next_multiple_of(N), 0);
        self.0.extend(bytes);
    }

    fn text(&mut self, text: &str) {
        self.number(length(text.len() + 1).to_le_bytes());
        self.0.extend(text.bytes().chain([0]));
    }

    fn message(self) -> Vec<u8> {
        // The order of bytes stands before the message.
        [0, 1, 0, 0].into_iter().chain(self.0).collect()
    }
}

/// A text as a message.
pub fn text(text: &str) -> Vec<u8> {
    let mut cdr = Cdr::default();
    cdr.text(text);
    cdr.message()
}

/// A number as a message.
pub fn number(value: f64) -> Vec<u8> {
    let mut cdr = Cdr::default();
    cdr.number(value.to_le_bytes());
    cdr.message()
}

/// A pose of a body in the frame of another: the names of both, position in m, rotation as w, x, y, z.
pub struct Pose<'a> {
    /// In whose frame.
    pub parent: &'a str,
    /// The body.
    pub child: &'a str,
    /// m.
    pub position: [f64; 3],
    /// parent_from_child: w, x, y, z.
    pub rotation: [f64; 4],
}

/// Poses at a time, ns, as a message.
pub fn poses(time: u64, poses: &[Pose]) -> Vec<u8> {
    let mut cdr = Cdr::default();
    cdr.number(length(poses.len()).to_le_bytes());
    for Pose { parent, child, position, rotation: [w, x, y, z] } in poses {
        cdr.number(i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX).to_le_bytes());
        cdr.number(((time % 1_000_000_000) as u32).to_le_bytes());
        cdr.text(parent);
        cdr.text(child);
        for value in position.iter().chain([x, y, z, w]) {
            cdr.number(value.to_le_bytes());
        }
    }
    cdr.message()
}

fn length(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}
