"""python3 convert.py record-test OUT

A gripper that is told to close further than it does holds something: the command is the witness of what the measured opening shows.
"""

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from labels import two_labels, write_labels, write_log  # noqa: E402

RATE = 30  # Hz
GAP = 3.0  # percent of the opening by which the command is below the measured one
JOINTS = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]


def main():
    download, out = map(Path, sys.argv[1:])
    table = parquet.read_table(download / "data/chunk-000/file-000.parquet")
    state, command = (np.array(table[name].to_pylist()) for name in ("observation.state", "action"))
    time, episode = (table[name].to_numpy() for name in ("timestamp", "episode_index"))
    for number in np.unique(episode):
        rows = episode == number
        opening, wanted = state[rows, 5], command[rows, 5]
        still = np.abs(np.gradient(opening)) * RATE < 5.0  # percent/s: a gripper that lags behind a moving command holds nothing
        held = (opening - wanted > GAP) & still
        log = out / f"episode_{number:02}.csv"
        write_log(log, ["t", *JOINTS], np.c_[time[rows], state[rows]])
        write_labels(log, two_labels(held, "held", "free", shortest=RATE // 2, bridge=RATE // 5))


if __name__ == "__main__":
    main()
