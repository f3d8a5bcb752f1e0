#!/usr/bin/env python3
"""Makes `pick_block`, a LeRobot set (v3.0) of an SO-101 that was never moved: joints by inverse kinematics along a path of ours, read as ticks of its motors.

    python3 -m venv venv && venv/bin/pip install numpy pandas pyarrow
    venv/bin/python examples/so101_joints/make_set.py
"""

import json
import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

HERE = Path(__file__).resolve().parent
SET = HERE / "pick_block"
MOTORS = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]
FPS = 30
TICK = 360 / 4095
OPEN, SHUT = 60.0, 0.5
"""Of the gripper, percent."""
BLOCK, PLACE = (0.23, -0.09), (0.21, 0.11)
SIZE = 0.03
"""Edge of the block, m."""
TILT = np.radians(25)
"""Of the gripper, from straight down to the front; the wrist does not bend far enough for none."""


def rotation(axis, angle):
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def numbers(element, key):
    return np.array([float(part) for part in (element.get(key) if element is not None and element.get(key) else "0 0 0").split()])


class Arm:
    """The links of robots/so101.urdf."""

    def __init__(self):
        root = ElementTree.parse(HERE.parent.parent / "robots/so101.urdf").getroot()
        self.joints = {}
        for joint in root.iter("joint"):
            origin = joint.find("origin")
            roll, pitch, yaw = numbers(origin, "rpy")
            turned = rotation((0, 0, 1), yaw) @ rotation((0, 1, 0), pitch) @ rotation((1, 0, 0), roll)
            child = joint.find("child").get("link")
            self.joints[child] = (joint.find("parent").get("link"), joint.get("name"), numbers(origin, "xyz"), turned)
        limits = {joint.get("name"): joint.find("limit") for joint in root.iter("joint")}
        self.limits = np.array([[float(limits[motor].get(end)) for end in ("lower", "upper")] for motor in MOTORS[:5]]).T

    def pose(self, link, angles):
        """Position and rotation of a link; angles by joint, rad."""
        if link not in self.joints:
            return np.zeros(3), np.eye(3)
        parent, joint, position, turned = self.joints[link]
        at, rotated = self.pose(parent, angles)
        return at + rotated @ position, rotated @ turned @ rotation((0, 0, 1), angles.get(joint, 0.0))

    def opening(self, percent):
        angles = {"gripper": np.radians(-10 + 1.1 * percent)}
        return np.linalg.norm(self.pose("moving_jaw_pad", angles)[0] - self.pose("fixed_jaw_pad", angles)[0])

    def percent(self, opening):
        low, high = 0.0, 100.0
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (middle, high) if self.opening(middle) < opening else (low, middle)
        return low

    def reach(self, target, start):
        """Angles of the arm, rad, with the middle of the block between the jaws at `target`."""
        ahead = np.array(target[:2]) - self.joints["shoulder_link"][2][:2]
        upward = -np.sin(TILT) * ahead / np.linalg.norm(ahead)

        def residual(q):
            position, turned = self.pose("fixed_jaw_pad", dict(zip(MOTORS, q)))
            middle = position + turned @ (SIZE / 2, 0, 0)
            return np.concatenate([(middle - target) * 10, turned[:2, 2] - upward, [0.05 * (q[4] - start[4])]])

        q = np.array(start)
        for _ in range(100):
            now = residual(q)
            slope = np.array([(residual(q + 1e-6 * one) - now) / 1e-6 for one in np.eye(5)]).T
            step = np.linalg.solve(slope.T @ slope + 1e-6 * np.eye(5), slope.T @ now)
            q = q - step
            if np.abs(step).max() < 1e-6:
                break
        assert np.abs(residual(q)[:5]).max() < 1e-2, (target, residual(q))
        assert (self.limits[0] < q).all() and (q < self.limits[1]).all(), (target, np.degrees(q))
        return q


def waypoints(arm, aims, slips):
    """Duration, place of the block between the jaws, and gripper of each part of an episode. The gripper closes at each aim until it has the block."""
    held = arm.percent(SIZE)
    high, low = 0.09, SIZE / 2
    start = (0.18, 0.0, 0.11)
    parts = [(0.7, start, OPEN)]
    for aim, hits in aims:
        parts += [(1.5, (*aim, high), OPEN), (1.0, (*aim, low), OPEN), (0.7, (*aim, low), held if hits else SHUT)]
        parts += [(0.4, (*aim, low), held if hits else SHUT)]
        if not hits:
            parts += [(0.7, (*aim, low), OPEN), (0.8, (*aim, high), OPEN)]
    parts += [(1.0, (*BLOCK, high), held)]
    if slips:
        half = tuple((b + p) / 2 for b, p in zip(BLOCK, PLACE))
        parts += [(0.8, (*half, high), held), (0.25, (*half, high), SHUT), (0.8, (*PLACE, high), SHUT), (0.5, (*PLACE, high), OPEN)]
    else:
        parts += [(1.5, (*PLACE, high), held), (1.0, (*PLACE, low), held), (0.3, (*PLACE, low), held)]
        parts += [(0.6, (*PLACE, low), OPEN), (1.0, (*PLACE, high), OPEN)]
    return parts + [(1.2, start, OPEN), (0.6, start, OPEN)]


def episode(arm, aims, slips=False):
    """Commanded and measured numbers of the motors, a row a frame."""
    parts = waypoints(arm, aims, slips)
    place, gripper = np.array(parts[0][1]), parts[0][2]
    angles = arm.reach(place, np.radians([0, -30, 30, 60, 0]))
    rows = []
    for seconds, target, opened in parts:
        for frame in range(round(seconds * FPS)):
            part = (frame + 1) / round(seconds * FPS)
            eased = part**2 * (3 - 2 * part)
            angles = arm.reach(place + (np.array(target) - place) * eased, angles)
            rows.append([*np.degrees(angles), gripper + (opened - gripper) * eased])
        place, gripper = np.array(target), opened
    action = np.array(rows)
    # The arm follows its commands with a delay of two frames; the encoder of a motor counts ticks, and flickers by one.
    flicker = np.random.default_rng(1).choice([-1, 0, 0, 0, 1], action.shape)
    state = action[np.maximum(np.arange(len(action)) - 2, 0)] * [1, 1, 1, 1, 1, 1.1]
    state = (np.round(state / TICK) + flicker) * TICK / [1, 1, 1, 1, 1, 1.1]
    state[:, 5] = np.clip(state[:, 5], 0, 100)
    return action.astype(np.float32), state.astype(np.float32)


def main():
    arm = Arm()
    beside = (BLOCK[0] - 0.045, BLOCK[1] + 0.02)
    episodes = [episode(arm, [(BLOCK, True)]), episode(arm, [(beside, False), (BLOCK, True)]), episode(arm, [(BLOCK, True)], slips=True)]
    shutil.rmtree(SET, ignore_errors=True)
    task = "put the block on the plate"
    columns = {key: [] for key in ("action", "observation.state", "timestamp", "frame_index", "episode_index", "index", "task_index")}
    listed, first = [], 0
    for number, (action, state) in enumerate(episodes):
        count = len(action)
        columns["action"].extend(action)
        columns["observation.state"].extend(state)
        columns["timestamp"].extend((np.arange(count) / FPS).astype(np.float32))
        columns["frame_index"].extend(range(count))
        columns["episode_index"].extend([number] * count)
        columns["index"].extend(range(first, first + count))
        columns["task_index"].extend([0] * count)
        listed.append({
            "episode_index": number, "tasks": [task], "length": count, "data/chunk_index": 0, "data/file_index": 0,
            "dataset_from_index": first, "dataset_to_index": first + count, "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
        })
        first += count
    vector = pa.list_(pa.float32(), 6)
    kinds = {"action": vector, "observation.state": vector, "timestamp": pa.float32()}
    table = pa.table({key: pa.array([list(v) for v in values] if key in ("action", "observation.state") else values, kinds.get(key, pa.int64()))
                      for key, values in columns.items()})
    for path, content in (
        ("data/chunk-000/file-000.parquet", table),
        ("meta/episodes/chunk-000/file-000.parquet", pa.Table.from_pylist(listed)),
        ("meta/tasks.parquet", pa.Table.from_pandas(pd.DataFrame({"task_index": [0]}, index=[task]))),
    ):
        (SET / path).parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(content, SET / path)
    plain = {"dtype": "int64", "shape": [1], "names": None}
    motors = {"dtype": "float32", "shape": [6], "names": [f"{motor}.pos" for motor in MOTORS]}
    info = {
        "codebase_version": "v3.0", "robot_type": "so101_follower", "total_episodes": len(episodes), "total_frames": first, "total_tasks": 1,
        "chunks_size": 1000, "data_files_size_in_mb": 100, "video_files_size_in_mb": 200, "fps": FPS, "splits": {"train": f"0:{len(episodes)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": None,
        "features": {
            "action": motors, "observation.state": motors, "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            "frame_index": plain, "episode_index": plain, "index": plain, "task_index": plain,
        },
    }
    (SET / "meta/info.json").write_text(json.dumps(info, indent=4) + "\n")
    print(f"{SET.name}: {first} frames, {sum(path.stat().st_size for path in SET.rglob('*') if path.is_file()) // 1000} kB")


if __name__ == "__main__":
    main()
