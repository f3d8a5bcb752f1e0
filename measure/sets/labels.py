"""Tables of logs and labels, for the converters in the folders beside this file."""

import csv
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


def two_labels(flags, inside, outside, shortest=1, bridge=0):
    """Rows [start, end, label] that cover a recording: `inside` where `flags` hold, `outside` elsewhere."""
    rows, at = [], 0
    for start, end in runs(flags, shortest, bridge):
        rows += [(at, start, outside), (start, end, inside)]
        at = end
    rows.append((at, len(flags), outside))
    return [row for row in rows if row[0] < row[1]]


def write_log(path, header, rows):
    """A log: a header and rows of numbers."""
    path.parent.mkdir(parents=True, exist_ok=True)
    table(path, header, ([f"{value:.6g}" for value in row] for row in rows))


def write_labels(log, rows, track=False):
    """The label file of a log: rows (start, end, label), with the hand as a fourth item if there are several."""
    header = ["start_row", "end_row", "label"] + ["track"] * track
    table(log.with_suffix(".labels.csv"), header, rows)


def table(path, header, rows):
    with open(Path(path), "w", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(header)
        lines.writerows(rows)
