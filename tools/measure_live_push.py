#!/usr/bin/env python3
"""Measures what a row costs in `teachtree.Live.push`, to be compared with `cargo bench -p teachtree-measure --bench engine -- live` on the same recordings.

    teachtree teach hand_over_left_to_right hand_over_left_to_right -o log.csv
    python tools/measure_live_push.py log.csv

The rows are pushed again and again, each with the next stamp, as arrays of doubles. The median row does little else than to be taken, so that the
difference of the medians is what Python adds.
"""

import sys
import time
from pathlib import Path

import numpy as np
import teachtree

ROWS = 60_000


def main(log):
    table = np.genfromtxt(log, delimiter=",", names=True, deletechars="", encoding="utf-8")
    names = Path(log).read_text(encoding="utf-8").split("\n", 1)[0].split(",")
    rows = np.array([list(row) for row in table], dtype=float)
    scene = Path(log).with_suffix(".scene.yaml")
    calibration = teachtree.Calibration(teachtree.Rules(), teachtree.Log(log), whole=True)
    live = teachtree.Live(calibration, names, scene=scene)
    step = rows[1, 0] - rows[0, 0]
    times, events, clock = [], 0, time.perf_counter_ns
    for at in range(ROWS):
        row = rows[at % len(rows)].copy()
        row[0] = at * step
        start = clock()
        events += len(live.push(row))
        times.append(clock() - start)
    idle = sorted(clock() - clock() for _ in range(1000))[500]
    times = np.array(times) + idle
    median, last = np.percentile(times, [50, 99.9]) / 1000
    print(f"{log}: {ROWS} rows of {len(names)} values, {events} events: median {median:.2f} µs, mean {times.mean() / 1000:.1f} µs, 99.9 % {last:.0f} µs")


if __name__ == "__main__":
    for log in sys.argv[1:]:
        main(log)
