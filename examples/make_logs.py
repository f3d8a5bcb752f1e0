#!/usr/bin/env python3
"""Makes the text logs of the worked examples: simulated recordings of `teachtree teach`, with the columns, units and rates of other programs.

    python3 examples/make_logs.py target/release/teachtree

Names of objects, such as `plug`, are ours; the simulation calls it `peg`.
"""

import csv
import math
import subprocess
import sys
import tempfile
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parent


class Rows:
    """A recording of `teachtree teach`, reduced to every `step`-th row. Forces are means over a step, as a sensor with a filter measures them."""

    def __init__(self, program, scene, operator, seed, step, fails=True):
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "log.csv"
            if not fails:
                lines = (EXAMPLES.parent / f"scenes/{operator}.operator.yaml").read_text().splitlines(keepends=True)
                operator = str(Path(folder) / "operator.yaml")
                Path(operator).write_text("".join(line for line in lines if not line.startswith("failures:")))
            subprocess.run(
                [program, "teach", scene, operator, "--seed", str(seed), "-o", str(log)],
                check=True,
                stdout=subprocess.DEVNULL,
            )
            with open(log, newline="") as file:
                titles, *rows = csv.reader(file)
        names = [title.split(" [")[0] for title in titles]
        self.rows = [dict(zip(names, row)) for row in rows]
        self.starts = range(0, len(rows) - step + 1, step)
        self.step = step

    def number(self, start, name):
        if ".force." in name:
            part = self.rows[start : start + self.step]
            return sum(float(row[name]) for row in part) / len(part)
        return float(self.rows[start][name])

    def vector(self, start, name, scale=1.0):
        return [scale * self.number(start, f"{name}.{axis}") for axis in "xyz"]

    def quaternion(self, start, name):
        return [self.number(start, f"{name}.{axis}") for axis in "wxyz"]

    def tool_point(self, start, hand):
        """The middle between the thumb and the other fingers, mm."""
        thumb, index, middle = (self.vector(start, f"{hand}.{finger}.position", 1e3) for finger in ("thumb", "index", "middle"))
        return [t / 2 + (i + m) / 4 for t, i, m in zip(thumb, index, middle)]

    def opening(self, start, hand):
        """The distance between the pads, whose radius is 10 mm, in mm."""
        thumb, index, middle = (self.vector(start, f"{hand}.{finger}.position", 1e3) for finger in ("thumb", "index", "middle"))
        return math.dist(thumb, [(i + m) / 2 for i, m in zip(index, middle)]) - 20


def texts(values, decimals):
    return [f"{value + 0.0:.{decimals}f}" for value in values]


def write(path, lines):
    with open(EXAMPLES / path, "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(lines)
    size = (EXAMPLES / path).stat().st_size
    print(f"{path}: {size // 1000} kB")


def xyz(name, unit=""):
    return [f"{name}_{axis}{unit}" for axis in "xyz"]


def quaternion_titles(name):
    return [f"{name}_q{axis}" for axis in "wxyz"]


def plug_into_socket(program):
    """An arm with a gripper and a force sensor at the wrist, 50 Hz."""
    titles = ["time [s]", *xyz("tcp", " [mm]"), *quaternion_titles("tcp"), "gripper [mm]", "fx [N]", "fy [N]", "fz [N]"]
    titles += [*xyz("plug", " [mm]"), *quaternion_titles("plug")]
    for number, fails in ((1, False), (2, True)):
        log = Rows(program, "peg_in_hole", "peg_in_hole_jam", 1, 20, fails)
        lines = [
            texts([log.number(at, "time")], 2)
            + texts(log.tool_point(at, "right"), 1)
            + texts(log.quaternion(at, "right.palm.rotation"), 4)
            + texts([log.opening(at, "right")], 1)
            + texts(log.vector(at, "right.palm.force"), 2)
            + texts(log.vector(at, "peg.position", 1e3), 1)
            + texts(log.quaternion(at, "peg.rotation"), 4)
            for at in log.starts
        ]
        write(f"plug_into_socket/plug_{number}.csv", [titles, *lines])


def contact_flags(program):
    """A gripper whose two pads have switches, 100 Hz."""
    log = Rows(program, "pick_and_place", "pick_and_place_drop", 1, 10)
    titles = ["t_ms", *xyz("pad_a"), *xyz("pad_b"), "touch_a", "touch_b", *xyz("box"), *quaternion_titles("box")]
    lines = [
        texts([1e3 * log.number(at, "time")], 0)
        + texts(log.vector(at, "right.thumb.position"), 4)
        + texts(log.vector(at, "right.index.position"), 4)
        + texts([log.number(at, "right.thumb.contact"), log.number(at, "right.index.contact")], 0)
        + texts(log.vector(at, "box.position"), 4)
        + texts(log.quaternion(at, "box.rotation"), 4)
        for at in log.starts
    ]
    write("contact_flags/box.csv", [titles, *lines])


def hand_over(program):
    """Two arms with grippers, 50 Hz."""
    titles = ["stamp"]
    for arm in ("left", "right"):
        titles += [*xyz(f"{arm}_tcp"), f"{arm}_gripper"]
    titles += [*xyz("box"), *quaternion_titles("box")]
    for number, operator, seed in ((1, "hand_over_left_to_right", 1), (2, "hand_over_drop", 9)):
        log = Rows(program, "hand_over_left_to_right", operator, seed, 20)
        lines = []
        for at in log.starts:
            line = texts([log.number(at, "time")], 2)
            for arm in ("left", "right"):
                line += texts([value / 1e3 for value in log.tool_point(at, arm)], 4)
                line += texts([log.opening(at, arm) / 1e3], 4)
            lines.append(line + texts(log.vector(at, "box.position"), 4) + texts(log.quaternion(at, "box.rotation"), 4))
        write(f"hand_over/hand_over_{number}.csv", [titles, *lines])


def motion_capture(program):
    """A file as Motive of OptiTrack exports it: y up, mm, quaternions x y z w; a rigid body and a marker on each of three fingertips, 50 Hz."""
    log = Rows(program, "pick_and_place", "pick_and_place_miss", 5, 20)
    markers = ["thumb", "index", "middle"]
    kinds = ["Rigid Body"] * 7 + ["Marker"] * 9
    names = ["box"] * 7 + [f"hand:{marker}" for marker in markers for _ in range(3)]
    parts = ["Rotation"] * 4 + ["Position"] * 12
    start = "2026-03-02 10.15.00.000 AM"
    about = {
        "Format Version": "1.23",
        "Take Name": "box",
        "Take Notes": "",
        "Capture Frame Rate": "50.000000",
        "Export Frame Rate": "50.000000",
        "Capture Start Time": start,
        "Capture Start Frame": "0",
        "Total Frames in Take": str(len(log.starts)),
        "Total Exported Frames": str(len(log.starts)),
        "Rotation Type": "Quaternion",
        "Length Units": "Millimeters",
        "Coordinate Space": "Global",
    }

    def y_up(vector):
        x, y, z = vector
        return [x, z, -y]

    lines = [
        [text for entry in about.items() for text in entry],
        [],
        ["", "Type", *kinds],
        ["", "Name", *names],
        ["", "ID", *[f"{math.floor(index / 7):X}0" if index < 7 else f"M{(index - 7) // 3}" for index in range(len(names))]],
        ["", "", *parts],
        ["Frame", "Time (Seconds)", *"XYZW", *"XYZ", *("XYZ" * 3)],
    ]
    for frame, at in enumerate(log.starts):
        w, x, y, z = log.quaternion(at, "box.rotation")
        line = [str(frame), *texts([log.number(at, "time")], 6), *texts([*y_up([x, y, z]), w], 6)]
        line += texts(y_up(log.vector(at, "box.position", 1e3)), 3)
        for marker in markers:
            line += texts(y_up(log.vector(at, f"right.{marker}.position", 1e3)), 3)
        lines.append(line)
    write("motion_capture/box.csv", lines)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    program = str(Path(sys.argv[1]).resolve())
    for make in (plug_into_socket, contact_flags, hand_over, motion_capture):
        make(program)
