"""python3 convert.py UCI-RobotExecutionFaliuresDataSet OUT

Windows of 315 ms one after the other; labels are the authors' classes. The first window is normal.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from labels import write_labels, write_log  # noqa: E402


def main():
    download, out = map(Path, sys.argv[1:])
    for number in (1, 2, 4, 5):
        forces, classes = [], []
        for line in (download / f"lp{number}.data").read_text().split("\n"):
            if line[:1].isalpha():
                classes.append(line.strip())
            elif line.strip():
                forces.append([float(value) for value in line.split()])
        forces = np.array(forces)
        width = len(forces) // len(classes)
        log = out / f"lp{number}.csv"
        write_log(log, ["fx", "fy", "fz", "tx", "ty", "tz"], forces)
        write_labels(log, [(width * at, width * (at + 1), "normal" if name == "normal" else "failure") for at, name in enumerate(classes)])


if __name__ == "__main__":
    main()
