#!/usr/bin/env python3
"""Measures rules that are learned from labels against other learners (docs/learning.md), on groups of recordings that were held out.

    python3 tools/measure_learning.py TEACHTREE DATA SET [--curve DRAWS]

DATA has the folders `desk_yumi`, `icsc_hmm`, `hiro_snap` and `myodm`; SET is `desk`, `wiping`, `snap` or `myodm`. The program needs numpy
and scikit-learn. Methods: the shipped rules, the same fitted (`fit`), learned rules (`learn`), a decision tree of frames with 12 leaves,
a random forest of 100 trees, and the forest decoded by Viterbi with one penalty for a change. The trees read the quantities of the
learned rules and their least and greatest values in windows.

Without `--curve`, each group is held out once, of more than ten several together. With it, a group is drawn and held out, and 1, 2, 4, 8,
16 and all recordings of the others are drawn and learned from, DRAWS times; Ctrl+C ends after the present draw and prints those that are
complete. Measures are those of docs/score.md.
"""

import argparse
import csv
import json
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.tree import DecisionTreeClassifier

ROOT = Path(__file__).resolve().parent.parent
BINDINGS = ROOT / "demos/bindings"
SEED = 1
WINDOWS_S = (1, 2, 4)
# Frames that a tree learns from: every fourth of 20 Hz.
STRIDE = 4
SETTLE_S = 0.6
# The logarithm of the probability of a change of the label from one frame to the next that a tree reads.
CHANGE = -6.0
LATEST_S = 20.0
# The most times that groups are held out.
FOLDS = 10

FEATURES = """use "stream.rules"
stream {{ for each hand {{ optional gripper.closed : bool = false }} }}
{apart}
for each hand {{
  signal closed = gripper.closed
  signal place = mean(fingers.position)
  signal height = place.z
  signal speed = norm(rate(place, 500 ms))
  signal climb = rate(height, 500 ms)
  signal force = norm(sum(fingers.force))
}}
primitive Rest
tree rest for each hand {{ else => Rest }}
"""
APART = "signal apart = norm(mean(left.fingers.position) - mean(right.fingers.position))"


def desk_labels(log):
    times = [float(row["t"]) for row in csv.DictReader(open(log))]
    rows = csv.DictReader(open(log.with_name(log.stem + "_segments.csv")))
    return [(row["surgeme"], times[int(row["start_frame"])], times[min(int(row["end_frame"]), len(times) - 1)]) for row in rows]


def state_labels(log):
    starts = [float(line) for line in (log / "R_State.dat").read_text().split()]
    last_s = float((log / "R_Torques.dat").read_text().rstrip().rpartition("\n")[2].split()[0])
    return [(str(at), start, end) for at, (start, end) in enumerate(zip(starts, [*starts[1:], last_s]), 1)]


def row_labels(log):
    times = [float(row["t"]) for row in csv.DictReader(open(log))]
    rows = csv.DictReader(open(log.with_suffix(".labels.csv")))
    return [(row["label"], times[int(row["start_row"])], times[min(int(row["end_row"]), len(times) - 1)]) for row in rows]


def column_labels(log):
    rows = [(float(row["t"]), row["label"]) for row in csv.DictReader(open(log))]
    starts = [0] + [at for at in range(1, len(rows)) if rows[at][1] != rows[at - 1][1]] + [len(rows) - 1]
    return [(rows[one][1], rows[one][0], rows[end][0]) for one, end in zip(starts, starts[1:])]


SETS = {
    "desk": {
        "logs": "desk_yumi/S?_T?.csv",
        "binding": "desk_yumi",
        "track": "both",
        "map": "S1=Approach,S2=Grasp,S3=Lift,S4=Transfer,S5=Exchange,S6=Bring,S7=Place",
        "group": r"^(S\d)",
        "rules": ROOT / "examples/desk_surgemes.rules",
        "signals": ["closed", "height", "speed", "climb", "apart"],
        "labels": desk_labels,
    },
    "wiping": {
        "logs": "icsc_hmm/wiping_*_?.csv",
        "binding": "icsc_wiping",
        "track": "right",
        "map": "1=Approach,2=Wipe,3=Retreat",
        "group": r"^(.*)$",
        "rules": None,
        "signals": ["height", "speed", "climb", "force"],
        "labels": column_labels,
    },
    # The starts of the states of a robot, in the recordings that succeed.
    "snap": {
        "logs": "hiro_snap/S-*",
        "binding": "hiro_snap",
        "track": "right",
        "map": "1=Approach,2=Align,3=Insert,4=Mate",
        "group": r"^(.*)$",
        "rules": None,
        "signals": ["height", "speed", "climb", "force"],
        "labels": state_labels,
    },
    # The thing is 5 mm above where it began; a group has a thing. `measure/sets/myodm` makes the folder.
    "myodm": {
        "logs": "myodm/*_*.csv",
        "binding": "myodm",
        "track": "right",
        "map": "air=Translate,table=Rest",
        "group": r"^([a-z0-9]+)_",
        "rules": None,
        "signals": ["height", "speed", "climb"],
        "labels": row_labels,
    },
}


class Segments:
    """Counts of segments, frames and edits; those of recordings add up."""

    def __init__(self):
        self.found = dict.fromkeys((10, 25, 50), 0)
        self.truths = self.results = self.right = self.frames = 0
        self.edits, self.late_s = [], []

    def add(self, truth, result, rate_hz):
        known = truth >= 0
        truth, result = truth[known], result[known]
        true_runs, runs = runs_of(truth), runs_of(result)
        self.truths += len(true_runs)
        self.results += sum(label >= 0 for label, _, _ in runs)
        self.right += int((truth == result).sum())
        self.frames += len(truth)
        for share in self.found:
            taken = set()
            for label, start, end in runs:
                overlaps = [
                    ((min(end, stop) - max(start, begin)) / (max(end, stop) - min(start, begin)), -at)
                    for at, (name, begin, stop) in enumerate(true_runs)
                    if name == label and begin < end and start < stop
                ]
                overlap, at = max(overlaps, default=(0, 0))
                if overlap >= share / 100 and -at not in taken:
                    taken.add(-at)
                    self.found[share] += 1
                    # The first segment begins with the recording, not at a boundary.
                    if share == 50 and at != 0:
                        self.late_s.append(abs(start - true_runs[-at][1]) / rate_hz)
        one, other = [run[0] for run in true_runs], [run[0] for run in runs if run[0] >= 0]
        self.edits.append(1 - distance(one, other) / max(len(one), len(other), 1))

    def f1(self, share=50):
        return 200 * self.found[share] / max(self.truths + self.results, 1)

    def cells(self):
        f1 = "/".join(f"{self.f1(share):.1f}" for share in self.found)
        late = f"{np.median(self.late_s):.2f}" if self.late_s else "–"
        return [f1, f"{100 * np.mean(self.edits):.1f}", f"{100 * self.right / max(self.frames, 1):.1f}", late]


def runs_of(labels):
    bounds = [0, *(np.flatnonzero(np.diff(labels)) + 1), len(labels)] if len(labels) else [0]
    return [(int(labels[start]), int(start), int(end)) for start, end in zip(bounds, bounds[1:])]


def distance(one, other):
    row = list(range(len(other) + 1))
    for at, left in enumerate(one, 1):
        before, row[0] = row[:], at
        for place, right in enumerate(other, 1):
            row[place] = min(before[place] + 1, row[place - 1] + 1, before[place - 1] + (left != right))
    return row[-1]


def settled(labels, frames):
    result, state, begin = labels.copy(), labels[0], None
    for at in range(1, len(labels)):
        if labels[at] == state:
            begin = None
            continue
        begin = at if begin is None else begin
        last = at + 1 == len(labels) or labels[at + 1] != labels[at]
        if last and at + 1 - begin >= frames:
            state, result[begin : at + 1], begin = labels[at], labels[at], None
        else:
            result[at] = state
    return result


def viterbi(scores):
    best, back = scores[0].copy(), np.zeros(scores.shape, int)
    for at in range(1, len(scores)):
        change = best.max() + CHANGE
        back[at] = np.where(best >= change, np.arange(len(best)), best.argmax())
        best = np.maximum(best, change) + scores[at]
    path = [int(best.argmax())]
    for at in range(len(scores) - 1, 0, -1):
        path.append(int(back[at][path[-1]]))
    return np.array(path[::-1])


class Recording:
    """A recording with the labels and the features of its frames."""

    def __init__(self, program, kind, log, names, folder):
        self.log, self.group = log, re.search(kind["group"], log.stem).group(1)
        rules, table = folder / "features.rules", folder / "frames.csv"
        rules.write_text(FEATURES.format(apart=APART if "apart" in kind["signals"] else ""))
        program("analyze", log, "--rules", rules, "--frames", table, "--signals", ",".join(kind["signals"]), "-o", folder / "out.csv")
        rows = list(csv.DictReader(open(table)))
        self.time = np.array([float(row["time [s]"]) for row in rows])
        self.rate_hz = 1 / np.median(np.diff(self.time))
        self.truth = np.full(len(rows), -1)
        for name, start_s, end_s in kind["labels"](log):
            if name in names:
                half = 0.5 / self.rate_hz
                self.truth[(self.time + half >= start_s) & (self.time + half < end_s)] = list(names).index(name)
        sides = [side for side in ("left", "right") if any(key.startswith(side) for key in rows[0])]
        found = {key.split(" ")[0]: np.array([float(row[key] or 0) for row in rows]) for key in rows[0] if is_number(rows, key)}
        hands = [self.of_hand(found, side) for side in sides]
        # What the hands have in common, whichever does it.
        columns = [f(pair) for pair in zip(*hands) for f in ((np.minimum.reduce, np.maximum.reduce) if len(hands) > 1 else (lambda pair: pair[0],))]
        if "apart" in found:
            columns += self.windows(found["apart"])
        self.features = np.stack(columns, 1)[::STRIDE]

    def of_hand(self, found, side):
        columns = []
        for name in ("height", "speed", "climb", "force"):
            if f"{side}.{name}" in found:
                columns += self.windows(found[f"{side}.{name}"])
        if f"{side}.closed" in found:
            closed = found[f"{side}.closed"] > 0.5
            columns.append(closed.astype(float))
            for event in (~closed[:-1] & closed[1:], closed[:-1] & ~closed[1:]):
                columns += self.times(np.r_[False, event])
        return columns

    def windows(self, values):
        columns = [values]
        for window_s in WINDOWS_S:
            frames = round(window_s * self.rate_hz)
            for turned in (values, values[::-1]):
                padded = np.r_[np.full(frames - 1, turned[0]), turned]
                view = np.lib.stride_tricks.sliding_window_view(padded, frames)
                step = 1 if turned is values else -1
                columns += [view.min(1)[::step], view.max(1)[::step]]
        return columns

    def times(self, event):
        at = np.arange(len(event))
        last = np.maximum.accumulate(np.where(event, at, -(10**9)))
        following = np.minimum.accumulate(np.where(event, at, 10**9)[::-1])[::-1]
        return [np.minimum(gap / self.rate_hz, LATEST_S) for gap in (at - last, following - at)]

    def full(self, labels):
        return np.repeat(labels, STRIDE)[: len(self.truth)]


def is_number(rows, key):
    try:
        return float(rows[len(rows) // 2][key]) is not None
    except ValueError:
        return False


class Measure:
    def __init__(self, args, folder):
        self.args, self.kind, self.folder = args, SETS[args.set], folder
        self.binding = BINDINGS / f"{self.kind['binding']}.binding.yaml"
        self.names = dict(pair.split("=") for pair in self.kind["map"].split(","))
        logs = sorted(Path(args.data).glob(self.kind["logs"]))
        logs = [log for log in logs if not log.stem.endswith(("_segments", ".labels"))]
        self.recordings = [Recording(self.program, self.kind, log, self.names, self.folder) for log in logs]
        self.label_files = {recording: self.table(recording) for recording in self.recordings}

    def program(self, *words, accepted=(0,)):
        command = [self.args.program, *map(str, words), "--binding", str(self.binding), "-q"]
        # Ctrl+C is for this program only.
        done = subprocess.run(command, capture_output=True, text=True, start_new_session=True)
        if done.returncode not in accepted:
            sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
        return done.stdout

    def table(self, recording):
        folder = self.folder / "labels"
        folder.mkdir(exist_ok=True)
        lines = ["track,label,start_s,end_s"]
        names = list(self.names.values())
        for label, start, end in runs_of(recording.truth):
            if label >= 0:
                stop = recording.time[end - 1] + 1 / recording.rate_hz
                lines.append(f"{self.kind['track']},{names[label]},{recording.time[start]:.6f},{stop:.6f}")
        path = folder / f"{recording.log.stem}.labels.csv"
        path.write_text("\n".join(lines) + "\n")
        return path

    def by_rules(self, words, recordings):
        """The labels that rules give recordings."""
        names, track = list(self.names.values()), self.kind["track"]
        for recording in recordings:
            table = self.folder / "result.csv"
            self.program("analyze", recording.log, *words, "--frames", table, "-o", self.folder / "out.csv")
            found = [row[f"{track}.label"] for row in csv.DictReader(open(table))]
            yield np.array([names.index(name) if name in names else -2 for name in found])

    def shipped(self, shown):
        rules = self.kind["rules"]
        return rules and (["--rules", rules], f"{len(rules.read_text().splitlines())} lines")

    def fit(self, shown):
        if not self.kind["rules"] or len(shown) < 4:
            return None
        labels = ["--labels", self.folder / "labels", "--rules", self.kind["rules"], "--anyway", "--format", "json", "--hold-out", 2]
        text = self.program("fit", *(one.log for one in shown), *labels, accepted=(0, 1))
        params = [one for one in json.loads(text)["params"] if one["before"] != one["after"]]
        sets = [word for one in params for word in ("--set", f"{one['param']}={one['after']:g} {one['unit']}")]
        return ["--rules", self.kind["rules"], *sets], f"{len(params)} params"

    def learn(self, shown):
        groups = {one.group for one in shown}
        if len(shown) < 2:
            return None
        rules = self.folder / "learned.rules"
        pattern = self.kind["group"] if len(groups) > 1 else "^(.*)$"
        words = ["--labels", self.folder / "labels", "--group-by", pattern, "--anyway", "-o", rules]
        self.program("learn", *(one.log for one in shown), *words)
        return ["--rules", rules], f"{len(rules.read_text().splitlines())} lines"

    def of_frames(self, model, shown, decode):
        known = [one.truth[::STRIDE] >= 0 for one in shown]
        features = np.concatenate([one.features[known] for one, known in zip(shown, known)])
        labels = np.concatenate([one.truth[::STRIDE][known] for one, known in zip(shown, known)])
        model.fit(features, labels)

        def labels_of(recording):
            if decode:
                chances = np.log(np.maximum(model.predict_proba(recording.features), 1e-3))
                return recording.full(model.classes_[viterbi(chances)])
            frames = max(round(SETTLE_S * recording.rate_hz), 1)
            return settled(recording.full(model.predict(recording.features)), frames)

        return labels_of

    def methods(self):
        tree = lambda: DecisionTreeClassifier(max_leaf_nodes=12, random_state=SEED)
        forest = lambda: RandomForestClassifier(100, min_samples_leaf=5, max_features="sqrt", random_state=SEED)
        return {
            "shipped rules": self.shipped,
            "shipped rules, fitted": self.fit,
            "learned rules": self.learn,
            "tree of frames": lambda shown: (self.of_frames(tree(), shown, False), "12 leaves"),
            "forest": lambda shown: (self.of_frames(forest(), shown, False), "100 trees"),
            "forest, Viterbi": lambda shown: (self.of_frames(forest(), shown, True), "100 trees"),
        }

    def measured(self, method, shown, held):
        """The counts, the size and the seconds of a method that learns from `shown`; `None` if it cannot."""
        start = time.perf_counter()
        model = method(shown)
        if not model:
            return None
        (found, size), seconds = model, time.perf_counter() - start
        labels = [found(one) for one in held] if callable(found) else self.by_rules(found, held)
        return list(zip(held, labels)), size, seconds

    def held_out(self):
        print("| method | F1@10/25/50 | edit | frames | boundary, s | size | seconds |\n|---|---|---|---|---|---|---|")
        groups = sorted({one.group for one in self.recordings})
        folds = [groups[at::FOLDS] for at in range(min(len(groups), FOLDS))]
        for name, method in self.methods().items():
            counts, sizes, seconds = Segments(), set(), 0.0
            for out in folds:
                shown = [one for one in self.recordings if one.group not in out]
                found = self.measured(method, shown, [one for one in self.recordings if one.group in out])
                if found is None:
                    break
                for recording, labels in found[0]:
                    counts.add(recording.truth, labels, recording.rate_hz)
                sizes.add(found[1])
                seconds += found[2]
            if counts.frames:
                print(f"| {name} | {' | '.join(counts.cells())} | {', '.join(sorted(sizes))} | {seconds / len(folds):.1f} |", flush=True)

    def curve(self, draws):
        chance = np.random.default_rng(SEED)
        found = defaultdict(lambda: defaultdict(list))
        groups = sorted({one.group for one in self.recordings})
        sizes, done, stopped = [], 0, []
        signal.signal(signal.SIGINT, lambda *_: stopped.append(True))
        while done < draws and not stopped:
            group = groups[chance.integers(len(groups))]
            others = [one for one in self.recordings if one.group != group]
            held = [one for one in self.recordings if one.group == group]
            order = chance.permutation(len(others))
            sizes = [size for size in (1, 2, 4, 8, 16) if size < len(others)] + [0]
            for size in sizes:
                shown = [others[at] for at in sorted(order[: size or None])]
                for name, method in self.methods().items():
                    result = self.measured(method, shown, held)
                    if result:
                        counts = Segments()
                        for recording, labels in result[0]:
                            counts.add(recording.truth, labels, recording.rate_hz)
                        found[name][size].append(counts.f1())
            done += 1
            last = {name: [round(f1[-1], 1) for f1 in of_size.values()] for name, of_size in found.items()}
            print(f"draw {done}, {group} held out: {last}", file=sys.stderr, flush=True)
        print(f"F1@50 of {done} draws, mean ± standard deviation\n\n| method | {' | '.join(str(size or 'all') for size in sizes)} |")
        print("|---" * (len(sizes) + 1) + "|")
        for name, of_size in found.items():
            cells = [f"{np.mean(of_size[size]):.1f} ± {np.std(of_size[size]):.1f}" if of_size[size] else "–" for size in sizes]
            print(f"| {name} | {' | '.join(cells)} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("data")
    parser.add_argument("set", choices=SETS)
    parser.add_argument("--curve", type=int, metavar="DRAWS")
    args = parser.parse_args()
    # An interrupted program removes the folder too.
    with tempfile.TemporaryDirectory(prefix="measure_learning_") as folder:
        measure = Measure(args, Path(folder))
        groups = len({one.group for one in measure.recordings})
        print(f"{args.set}: {len(measure.recordings)} recordings in {groups} groups\n", flush=True)
        if args.curve:
            measure.curve(args.curve)
        else:
            measure.held_out()


if __name__ == "__main__":
    main()
