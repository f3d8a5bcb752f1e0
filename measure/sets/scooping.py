"""Fruit scooping: two force sensors, one in the tool of a person and one in the wrist of the arm that holds the fruit.

Each sensor witnesses the contact that is measured by the other one, in trials in which the witness returns to its value at rest. A person scoops a melon
with a tool, and lets the pulp fall into a bowl; taps on the bowl reach the tool only, so that nothing is labeled from one second after the longest contact that
the witness felt. A contact by the witness lasts at least 0.2 s; losses of 0.3 s belong to it. Trials in which one begins or ends slowly are left out: the
person's other hand guides the arm, and its sensor feels that too.
"""

import numpy as np
import scipy.io

from labels import two_labels, write_labels, write_log

RATE = 100  # Hz: the repository resamples transforms at this rate, and both sensors have as many samples in the same time
ABOVE, BELOW = 4.0, 2.0  # N from the value at rest: contact begins and ends
AFTER = RATE  # rows behind the longest contact that are still labeled
EDGE = 3 * RATE // 10  # rows
STEADY = 1.5  # N: a value at rest that changes by more is not evidence, because the arm or the tool was turned


def change(force):
    """How far a force is from its value in the first 0.2 s, N."""
    return np.linalg.norm(force - np.median(force[: RATE // 5], axis=0), axis=1)


def steady(force):
    """Whether the force at rest is the same in the first and in the last 0.3 s."""
    first, last = (np.median(part, axis=0) for part in (force[: 3 * RATE // 10], force[-3 * RATE // 10 :]))
    return np.linalg.norm(last - first) < STEADY


def smooth(force):
    return np.convolve(change(force), np.ones(5) / 5, mode="same")


def is_sharp(force, start, end):
    """Whether a contact begins and ends within `EDGE`; a slower change is that of an arm or a tool which a hand turns."""
    size = smooth(force)
    before, last = size[max(0, start - EDGE) : start], size[max(0, end - EDGE) : end]
    return len(before) > 0 and before.min() < BELOW / 2 and last.max() > ABOVE


def touched(force):
    """Contact by hysteresis of the smoothed change."""
    state, flags = False, []
    for value in smooth(force):
        state = value > (BELOW if state else ABOVE)
        flags.append(state)
    return np.array(flags)


def convert(download, out, sensor, witness):
    """A log of `sensor` for each trial that has both, and its labels by `witness`."""
    folder = download / "S0_raw_data_parsing/raw_data/rawdata_sensors_parsed/FT"
    for file in sorted(folder.glob("S*_rawdata_FT.mat")):
        for number, trial in enumerate(scipy.io.loadmat(file)["rawdata_FT"][0], 1):
            if not trial.dtype.names or not {sensor, witness} <= set(trial.dtype.names):
                continue
            force, seen = (trial[name][0, 0][:3].T for name in (sensor, witness))
            rows = min(len(force), len(seen))
            force, seen = force[:rows], seen[:rows]
            if rows < 2 * RATE or not steady(seen):
                continue
            labels = two_labels(touched(seen), "contact", "free", shortest=RATE // 5, bridge=3 * RATE // 10)
            contacts = [(start, end) for start, end, label in labels if label == "contact"]
            if not contacts or not all(is_sharp(seen, *contact) for contact in contacts):
                continue
            _, last = max(contacts, key=lambda contact: contact[1] - contact[0])
            labels = [(start, min(end, last + AFTER), label) for start, end, label in labels if start < last + AFTER]
            log = out / f"{file.name[:3]}_{number:02}.csv"
            write_log(log, ["t", "fx", "fy", "fz"], np.c_[np.arange(rows) / RATE, force])
            write_labels(log, labels)
