#!/usr/bin/env python3
"""Makes logs, labels and simple peers of three public sets that no rule was chosen on (docs/recognition.md, Sets that nobody tuned on).

    python3 -m venv venv && venv/bin/pip install numpy mujoco
    venv/bin/pip download --no-deps MyoSuite==1.7.1 && unzip -d wheel MyoSuite-*.whl       # the model of the hand
    venv/bin/python tools/convert_foreign_sets.py myodm myosuite/envs/myo wheel myodm      # a clone of MyoHub/myosuite
    venv/bin/python tools/convert_foreign_sets.py board platonics_dataset/execution_data board
    venv/bin/python tools/convert_foreign_sets.py windows UCI-RobotExecutionFaliuresDataSet windows

Each command writes a log and `LOG.labels.csv` for each recording, and prints what thresholds reach: frames right, and segmental F1 at 50 % (docs/score.md).
"""

import csv
import shutil
import sys
from pathlib import Path

import numpy as np


def runs(flags, shortest=1, bridge=0):
    """Intervals [start, end) of rows in which `flags` hold; losses of up to `bridge` rows are passed over first."""
    edges = np.flatnonzero(np.diff(np.r_[0, np.asarray(flags, int), 0])).reshape(-1, 2).tolist()
    joined = []
    for start, end in edges:
        if joined and start - joined[-1][1] <= bridge:
            joined[-1][1] = end
        else:
            joined.append([start, end])
    return [(start, end) for start, end in joined if end - start >= shortest]


def write(path, header, rows):
    with open(path, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(header)
        table.writerows(rows)


def write_labels(path, intervals):
    write(path, ["start_row", "end_row", "label"], intervals)


def f1_parts(true, found):
    """Right segments at 50 % overlap, and all segments of both, of two sequences of flags."""
    segments = [[(*span, state) for state in (False, True) for span in runs(flags == state)] for flags in (true, found)]
    right, taken = 0, set()
    for start, end, state in sorted(segments[1]):
        overlaps = [
            (max(0, min(end, b) - max(start, a)) / (max(end, b) - min(start, a)), index)
            for index, (a, b, other) in enumerate(segments[0])
            if other == state
        ]
        share, index = max(overlaps, default=(0, None))
        if share >= 0.5 and index not in taken:
            taken.add(index)
            right += 1
    return np.array([right, len(segments[0]) + len(segments[1])])


def print_peer(name, pairs):
    """Prints how often a threshold agrees with the truth: pairs of flags, one a recording."""
    frames = np.concatenate([true == found for true, found in pairs]).mean()
    right, all_segments = sum(f1_parts(true, found) for true, found in pairs)
    print(f"{name}: frames {frames:.1%}, F1 at 50 % {2 * right / all_segments:.1%}")


def myodm(envs, wheel, out):
    """Fingertips by the model of the hand, and the pose of the thing; it is in the air where it is 5 mm above where it began.

    The folder is `near` where the thumb and a finger are within 50 mm of its origin for most of that time, else `far`.
    """
    import mujoco

    # The table and the things have meshes of their own, which fingertips do not need.
    text = (envs / "assets/hand/myohand_tabletop.xml").read_text()
    model_file = wheel / "myosuite/envs/myo/assets/hand/tips.xml"
    model_file.write_text("\n".join(line for line in text.splitlines() if "simpleTable" not in line))
    model = mujoco.MjModel.from_xml_path(str(model_file))
    data = mujoco.MjData(model)
    tips = ["THtip", "IFtip", "MFtip", "RFtip", "LFtip"]
    header = ["t", *(f"{tip}_{axis}" for tip in tips for axis in "xyz")]
    header += [*(f"object_{axis}" for axis in "xyz"), *(f"object_q{axis}" for axis in "wxyz")]
    pairs = []
    for file in sorted((envs / "myodm/data").glob("*.npz")):
        recording = np.load(file)
        rows = []
        for time, joints, thing in zip(recording["time"], recording["robot"], recording["object"]):
            data.qpos[:] = joints
            mujoco.mj_kinematics(model, data)
            place = thing[:3] + [0, 0, 0.035]  # of the body of the thing, in assets/hand/myohand_object.xml
            rows.append([time, *np.concatenate([data.site(tip).xpos for tip in tips]), *place, *thing[3:]])
        points = np.array(rows)[:, 1:19].reshape(-1, 6, 3)  # the tips, the thumb first, and the thing
        places = points[:, 5]
        in_air = places[:, 2] > np.median(places[:5, 2]) + 0.005
        near = np.linalg.norm(points[:, :5] - places[:, None], axis=2) < 0.05
        held = near[:, 0] & near[:, 1:].any(axis=1)
        folder = out / ("near" if held[in_air].mean() > 0.5 else "far")
        folder.mkdir(exist_ok=True)
        name = file.stem.removeprefix("MyoHand_")
        write(folder / f"{name}.csv", header, [[f"{value:.6g}" for value in row] for row in rows])
        spans = [(*span, label) for label, state in (("table", False), ("air", True)) for span in runs(in_air == state)]
        write_labels(folder / f"{name}.labels.csv", sorted(spans))
        step = recording["time"][1] - recording["time"][0]
        pairs.append((in_air, np.linalg.norm(np.gradient(places, step, axis=0), axis=1) > 0.05))
    print_peer("the thing is faster than 50 mm/s", pairs)


def board(folder, out):
    """An arm with a compliant controller: it is held back where its goal is 4 mm beyond it and it stands, slower than 2 mm/s, for a second."""
    rate = 20
    for direction, label in (("down", "pressed"), ("any", "held")):
        forces_held = []
        for file in sorted(folder.glob("data_trial*.csv")):
            table = np.genfromtxt(file, delimiter=",", names=True)
            place, goal, force = (
                np.stack([table[f"{name}_{axis}"] for axis in "xyz"], axis=1) for name in ("current_pos", "goal_pos", "force")
            )
            speed = np.linalg.norm(np.gradient(place, 1 / rate, axis=0), axis=1)
            beyond = place[:, 2] - goal[:, 2] if direction == "down" else np.linalg.norm(goal - place, axis=1)
            held = runs((beyond > 0.004) & (speed < 0.002), shortest=rate, bridge=rate // 4)
            (out / direction).mkdir(exist_ok=True)
            shutil.copy(file, out / direction)
            write_labels(out / direction / f"{file.stem}.labels.csv", [(*span, label) for span in held])
            forces_held += [np.linalg.norm(force[start:end], axis=1) for start, end in held]
        for least in (5, 3):
            share = (np.concatenate(forces_held) > least).mean()
            print(f"{direction}: force above {least} N in {share:.1%} of the time, {len(forces_held)} places")


def windows(folder, out):
    """Windows of 315 ms one after the other; labels are the authors' classes, `ok` and `normal` are no failure. The first window is normal."""
    for least in (5, 10):
        pairs = []
        for number in (1, 2, 4, 5):
            forces, classes = [], []
            for line in (folder / f"lp{number}.data").read_text().split("\n"):
                if line[:1].isalpha():
                    classes.append(line.strip())
                elif line.strip():
                    forces.append([float(value) for value in line.split()])
            forces = np.array(forces)
            width = len(forces) // len(classes)
            write(out / f"lp{number}.csv", ["fx", "fy", "fz", "tx", "ty", "tz"], forces.tolist())
            spans = [(width * at, width * (at + 1), "normal" if name == "normal" else "failure") for at, name in enumerate(classes)]
            write_labels(out / f"lp{number}.labels.csv", spans)
            change = np.linalg.norm(forces[:, :3] - forces[:width, :3].mean(0), axis=1)
            pairs.append((np.repeat([name != "normal" for name in classes], width), change > least))
        frames = np.concatenate([true == found for true, found in pairs]).mean()
        print(f"the force differs from the first window by {least} N: frames {frames:.1%}")


def main():
    convert = {"myodm": myodm, "board": board, "windows": windows}[sys.argv[1]]
    *inputs, out = map(Path, sys.argv[2:])
    out.mkdir(parents=True, exist_ok=True)
    convert(*inputs, out)


if __name__ == "__main__":
    main()
