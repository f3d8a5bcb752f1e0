#!/usr/bin/env python3
"""Makes `insertion`, a ROS 2 bag in MCAP, from a recording of `teachtree teach`.

    python3 -m venv venv && venv/bin/pip install rosbags
    venv/bin/python examples/ros2_bag/make_bag.py target/release/teachtree
"""

import shutil
import sys
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from make_logs import Rows  # noqa: E402

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
START = 1_772_446_500_000_000_000
CAMERA = np.array([0.5, -0.4, 0.6])
"""In `base_link`; its z axis points down, its x axis as that of `base_link`."""


def message(name, *fields):
    return TYPES[name](*fields)


def header(nanos, frame):
    return message("std_msgs/msg/Header", message("builtin_interfaces/msg/Time", nanos // 10**9, nanos % 10**9), frame)


def transform(nanos, parent, child, position, quaternion):
    w, x, y, z = quaternion
    moved = message("geometry_msgs/msg/Transform", message("geometry_msgs/msg/Vector3", *position), message("geometry_msgs/msg/Quaternion", x, y, z, w))
    return message("tf2_msgs/msg/TFMessage", [message("geometry_msgs/msg/TransformStamped", header(nanos, parent), child, moved)])


def pose(nanos, frame, position, quaternion):
    w, x, y, z = quaternion
    stands = message("geometry_msgs/msg/Pose", message("geometry_msgs/msg/Point", *position), message("geometry_msgs/msg/Quaternion", x, y, z, w))
    return message("geometry_msgs/msg/PoseStamped", header(nanos, frame), stands)


def messages(program):
    """Time of recording in ns, topic, message."""
    log = Rows(program, "peg_in_hole", "peg_in_hole_jam", 3, 10)
    yield START, "/tf_static", transform(START, "base_link", "camera", CAMERA, (0.0, 1.0, 0.0, 0.0))
    for number, at in enumerate(log.starts):
        nanos = START + round(log.number(at, "time") * 1e9)
        force = message("geometry_msgs/msg/Vector3", *log.vector(at, "right.palm.force"))
        wrench = message("geometry_msgs/msg/Wrench", force, message("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0))
        yield nanos, "/wrench", message("geometry_msgs/msg/WrenchStamped", header(nanos, "base_link"), wrench)
        if number % 2 == 0:
            tool = [value / 1e3 for value in log.tool_point(at, "right")]
            yield nanos, "/tf", transform(nanos, "base_link", "tool0", tool, log.quaternion(at, "right.palm.rotation"))
            width = np.array([log.opening(at, "right") / 1e3])
            yield nanos, "/joint_states", message("sensor_msgs/msg/JointState", header(nanos, ""), ["gripper_width"], width, np.array([]), np.array([]))
        if number % 4 == 0:
            # The camera is turned by half a turn about x.
            x, y, z = np.array(log.vector(at, "peg.position")) - CAMERA
            w, i, j, k = log.quaternion(at, "peg.rotation")
            yield nanos, "/plug_pose", pose(nanos, "camera", (x, -y, -z), (i, -w, k, -j))


def main(program):
    folder = HERE / "insertion"
    shutil.rmtree(folder, ignore_errors=True)
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer as bag:
        connections = {}
        for nanos, topic, content in messages(program):
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, content.__msgtype__, typestore=STORE)
            bag.write(connections[topic], nanos, STORE.serialize_cdr(content, content.__msgtype__))
    print(f"insertion: {sum(path.stat().st_size for path in folder.iterdir()) // 1000} kB")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(str(Path(sys.argv[1]).resolve()))
