#!/usr/bin/env python3
"""Makes the ROS 2 bags of the storage `sqlite3` in tests/fixtures/formats/rosbag2_db3, MCAP with protobuf in tests/fixtures/formats/foxglove, and the definitions of
common message types for bags without any.

    python3 -m venv venv && venv/bin/pip install rosbags numpy mcap-protobuf-support foxglove-schemas-protobuf
    venv/bin/python tools/make_bag_fixtures.py

`jazzy` is written by rosbags, with message definitions. `humble` has the tables that recorders of ROS 2 Humble write, which have none. `plain.mcap` has the same messages.
`protobuf.mcap` has Foxglove's schemas in protobuf, `json.mcap` the same messages in JSON.
`crates/logs/src/read/formats/ros_types.msg` has the definitions as ROS 2 Humble has them, without comments and constants.
"""

import json
import shutil
import sqlite3
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.json_format import MessageToDict
from mcap.writer import Writer as McapWriter
from mcap_protobuf.writer import Writer as ProtobufWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "tests/fixtures/formats/rosbag2_db3"
PACKAGES = ["builtin_interfaces", "std_msgs", "geometry_msgs", "sensor_msgs", "nav_msgs", "tf2_msgs", "trajectory_msgs"]
STORE = get_typestore(Stores.ROS2_HUMBLE)


def messages():
    """Topic, type, time of recording in ns, message."""
    types = STORE.types
    stamp, header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    for row in range(8):
        nanos = 1_700_000_000_000_000_000 + row * 20_000_000
        head = header(stamp(nanos // 10**9, nanos % 10**9), "world")
        wrench = types["geometry_msgs/msg/Wrench"](vector(1.0 * row, 0.0, -2.5), vector(0.0, 0.0, 0.1))
        yield "/wrench", "geometry_msgs/msg/WrenchStamped", nanos + 5_000_000, types["geometry_msgs/msg/WrenchStamped"](head, wrench)
        joints = types["sensor_msgs/msg/JointState"](head, ["left", "right"], np.array([0.01 * row, 0.02]), np.array([]), np.array([]))
        yield "/joint_states", "sensor_msgs/msg/JointState", nanos + 6_000_000, joints
        pose = types["geometry_msgs/msg/Transform"](vector(0.1 * row, 0.2, 0.3), quaternion(0.0, 0.0, 0.0, 1.0))
        poses = types["tf2_msgs/msg/TFMessage"]([types["geometry_msgs/msg/TransformStamped"](head, "cube", pose)])
        yield "/tf", "tf2_msgs/msg/TFMessage", nanos + 7_000_000, poses
        yield "/closed", "std_msgs/msg/Bool", nanos, types["std_msgs/msg/Bool"](row > 3)


def write(path, plugin):
    shutil.rmtree(path, ignore_errors=True)
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        connections = {}
        for topic, kind, time, message in messages():
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connections[topic], time, STORE.serialize_cdr(message, kind))


def humble(path):
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True)
    database = sqlite3.connect(path / "humble_0.db3")
    database.executescript("""
        CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
        CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);
        INSERT INTO schema VALUES (3, 'humble');
    """)
    topics = {}
    for topic, kind, time, message in messages():
        if topic not in topics:
            topics[topic] = len(topics) + 1
            database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (topics[topic], topic, kind))
        data = bytes(STORE.serialize_cdr(message, kind))
        database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", (topics[topic], time, data))
    # A type of a package of one's own, which no definition describes.
    database.execute("INSERT INTO topics VALUES (9, '/own', 'my_msgs/msg/Own', 'cdr', '')")
    database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (9, ?, ?)", (time, b"\0\1\0\0"))
    database.commit()
    database.close()
    (path / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n    - humble_0.db3\n"
        "  compression_format: \"\"\n  compression_mode: \"\"\n"
    )


def foxglove():
    """Messages of Foxglove's schemas: topic, time of recording in ns, message. Some fields are zero, which protobuf leaves out."""
    for row in range(6):
        nanos = 1_700_000_000_000_000_000 + row * 20_000_000
        pose = PoseInFrame(frame_id="world")
        pose.timestamp.FromNanoseconds(nanos)
        pose.pose.position.x, pose.pose.position.y, pose.pose.orientation.w = 0.1 * row, 0.2, 1.0
        yield "/tool", nanos + 30_000_000, pose
        transforms = FrameTransforms()
        for child in ["cube", "cup"]:
            transform = transforms.transforms.add(parent_frame_id="world", child_frame_id=child)
            transform.timestamp.FromNanoseconds(nanos)
            transform.translation.y, transform.rotation.w = -0.05 * row, 1.0
        yield "/tf", nanos + 40_000_000, transforms


def as_json(message):
    """A message with all fields that protobuf leaves out, and stamps as Foxglove has them in JSON."""
    plain = MessageToDict(message, preserving_proto_field_name=True, always_print_fields_with_no_presence=True)
    for part, own in zip(plain.get("transforms", [plain]), getattr(message, "transforms", [message])):
        part["timestamp"] = {"sec": own.timestamp.seconds, "nsec": own.timestamp.nanos}
    return plain


def foxglove_bags(folder):
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "protobuf.mcap", "wb") as file, ProtobufWriter(file) as writer:
        for topic, time, message in foxglove():
            writer.write_message(topic, message, log_time=time, publish_time=time)
    with open(folder / "json.mcap", "wb") as file:
        writer = McapWriter(file)
        writer.start()
        channels = {}
        for topic, time, message in foxglove():
            if topic not in channels:
                schema = writer.register_schema(message.DESCRIPTOR.full_name, "jsonschema", b"{}")
                channels[topic] = writer.register_channel(topic, "json", schema)
            writer.add_message(channels[topic], time, json.dumps(as_json(message)).encode(), time)
        writer.finish()


def definitions():
    """The definitions of all types of some packages, one after the other."""
    sections = []
    for name in sorted(STORE.fielddefs):
        if name.split("/")[0] not in PACKAGES:
            continue
        text, _ = STORE.generate_msgdef(name, ros_version=2)
        own = text.split("=" * 80)[0]
        lines = [line for line in own.splitlines() if line.strip() and "=" not in line]
        sections.append("\n".join(["=" * 80, f"MSG: {name.replace('/msg/', '/')}", *lines]))
    return "\n".join(sections) + "\n"


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    write(FOLDER / "jazzy", StoragePlugin.SQLITE3)
    humble(FOLDER / "humble")
    write(FOLDER / "mcap", StoragePlugin.MCAP)
    (FOLDER / "mcap/mcap.mcap").rename(FOLDER / "plain.mcap")
    shutil.rmtree(FOLDER / "mcap")
    foxglove_bags(FOLDER.parent / "foxglove")
    (ROOT / "crates/logs/src/read/formats/ros_types.msg").write_text(definitions())


if __name__ == "__main__":
    main()
