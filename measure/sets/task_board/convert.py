"""python3 convert.py platonics_dataset OUT

An arm with a compliant controller is held back where its goal is 4 mm beyond it and it stands, slower than 2 mm/s, for a second.
"""

import shutil
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from labels import runs, write_labels  # noqa: E402

RATE = 20  # Hz


def main():
    download, out = map(Path, sys.argv[1:])
    out.mkdir(parents=True, exist_ok=True)
    for file in sorted((download / "execution_data").glob("data_trial*.csv")):
        table = np.genfromtxt(file, delimiter=",", names=True)
        place, goal = (np.stack([table[f"{name}_{axis}"] for axis in "xyz"], axis=1) for name in ("current_pos", "goal_pos"))
        speed = np.linalg.norm(np.gradient(place, 1 / RATE, axis=0), axis=1)
        held = (np.linalg.norm(goal - place, axis=1) > 0.004) & (speed < 0.002)
        shutil.copy(file, out)
        write_labels(out / file.name, [(*span, "held") for span in runs(held, shortest=RATE, bridge=RATE // 4)])


if __name__ == "__main__":
    main()
