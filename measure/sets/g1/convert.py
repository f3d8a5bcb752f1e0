"""python3 convert.py G1-policy-train OUT

A finger that is told to close further than it does holds something: the command is the witness of what the measured fingers show.
The witness sees one hold in two of three episodes; the others are left out, as each of them has a hold by its task.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from labels import two_labels, write_labels, write_log  # noqa: E402

GAP = 0.025  # of the finger's way, by which the command is below the measured finger
FINGERS = ["Pinky", "Ring", "Middle", "Index"]
WINDOW = 15  # samples within which a finger and its command are at rest


def at_rest(column, limit):
    padded = np.pad(column, WINDOW // 2, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, WINDOW)
    return np.ptp(windows, axis=1) < limit


def main():
    download, out = map(Path, sys.argv[1:])
    joints = json.loads((download / "meta/info.json").read_text())["features"]["action"]["names"][0]
    fingers = [joints.index("kRightHand" + name) for name in [*FINGERS, "ThumbBend"]]
    for path in sorted(download.glob("data/chunk-000/*.parquet")):
        table = parquet.read_table(path)
        state, command = (np.array(table[name].to_pylist()) for name in ("observation.state", "action"))
        held = np.zeros(len(state), bool)
        for finger in fingers:
            resting = at_rest(state[:, finger], 0.02) & at_rest(command[:, finger], 0.06)
            held |= resting & (state[:, finger] - command[:, finger] > GAP)
        labels = two_labels(held, "held", "free", shortest=20, bridge=10)
        if sum(label == "held" for _, _, label in labels) != 1:
            continue
        log = out / f"{path.stem}.csv"
        hand = state[:, fingers[:4]].mean(axis=1)
        write_log(log, ["t", *joints, "right_hand"], np.c_[table["timestamp"].to_numpy(), state, hand])
        write_labels(log, labels)


if __name__ == "__main__":
    main()
