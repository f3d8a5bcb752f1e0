#!/usr/bin/env python3
"""Measures `teachtree learn --new` (docs/learning.md): each primitive of examples/primitives from three simulated recordings.

The labels are those of the primitive's own rule file. The learned file is compared with it on three other recordings, and on a recording of each shipped
operator with another seed than that of `learn`. Operators that fail on purpose have a column of their own: `learn` knows none of them. Every operator
varies like a person.

    python3 tools/measure_new_primitives.py TEACHTREE FOLDER [PRIMITIVE ...]

FOLDER receives the recordings, the labels and the learned files. Recordings that it has are used again.
"""

import csv
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCENES = ROOT / "scenes"
SHOWN, NEW, JUDGED = (101, 102, 103), (201, 202, 203), 302
# Their rules are those of two hands.
TWO_HANDS = ("assist", "join", "slide_over")

# The declaration, the scene, the shipped operator if it is not the one in the folder, and the factor of its variation.
PRIMITIVES = {
    "assist": ("Assist", "hold_and_insert", "hold_and_insert", 1),
    "drop": ("Drop", "pick_and_place", None, 1),
    "join": ("Join(side)", "ring_and_pole", "ring_and_pole", 1),
    "plug": ("Plug", "peg_in_hole", "peg_in_hole", 1),
    "pour": ("Pour", "pick_and_place", None, 1),
    "regrasp": ("Regrasp", "pick_and_place", None, 1),
    "shake": ("Shake", "pick_and_place", None, 1),
    "show": ("Show", "pick_and_place", None, 1),
    "slide_over": ("SlideOver", "hand_over_left_to_right", None, 1),
    "twist": ("Twist", "pick_and_place", None, 1),
    "unscrew": ("Unscrew", "turn_knob", "turn_knob", 1),
    # An operator who varies more does not stand still for 300 ms.
    "wait": ("Wait", "pick_and_place", None, 0.3),
    "wipe": ("Wipe", "slide", None, 1),
}
# Operators in the scene of another one.
OTHER_SCENES = {"hand_over_drop": "hand_over_left_to_right", "hold_and_insert_jam": "hold_and_insert"}
# The ends of the names of operators that fail on purpose.
FAILING = ("_collision", "_drop", "_jam", "_miss", "_slip")


def run(program, *words, expected=(0,)):
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
    if done.returncode not in expected:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
    return done.stdout


def teach(program, scene, operator, seed, variation, log):
    if not log.exists():
        log.parent.mkdir(parents=True, exist_ok=True)
        run(program, "teach", scene, operator, "--seed", seed, "--variation", variation, "-o", log)
    return log


def varying(operator, folder):
    """A copy of an operator file that varies like a person."""
    text = operator.read_text()
    copy = folder / operator.name
    copy.write_text(text if "\nvariation:" in text else f"{text}variation: human\n")
    return copy


def shipped(program, folder):
    """A recording of each shipped operator: those that succeed, those that fail on purpose."""
    logs = ([], [])
    for file in sorted(SCENES.glob("*.operator.yaml")):
        operator = file.name.removesuffix(".operator.yaml")
        scene = OTHER_SCENES.get(operator, operator)
        while not (SCENES / f"{scene}.yaml").exists():
            scene = scene.rpartition("_")[0] or sys.exit(f"{operator} has no scene")
        log = teach(program, scene, operator, JUDGED, 1, folder / f"{operator}_{JUDGED}.csv")
        logs[operator.endswith(FAILING)].append(log)
    return logs


def labels(program, logs, rules, folder):
    """Analyzes recordings; the results by recording."""
    folder.mkdir(parents=True, exist_ok=True)
    run(program, "analyze", *logs, "--rules", rules, "--format", "csv", "--out-dir", folder)
    return [folder / log.name for log in logs]


def spans(file, primitive):
    """The times of a primitive by track and name, and the duration of the recording."""
    found, end_s = {}, 0.0
    for row in csv.DictReader(file.open()):
        if row["kind"] == "relabeled":
            end_s = max(end_s, float(row["end_s"]))
            # The track of both hands covers those of the hands.
            is_wanted = row["name"].split("(")[0] == primitive and (row["track"] == "both" or "(" not in row["name"])
            if is_wanted:
                found.setdefault((row["track"], row["name"]), []).append((float(row["start_s"]), float(row["end_s"])))
    return found, end_s


def common(one, other):
    return max(0.0, min(one[1], other[1]) - max(one[0], other[0]))


def compared(truths, results, primitive):
    """Counts of intervals and times, s."""
    counts = dict(true=0, found=0, matched=0, right_s=0.0, wrong_s=0.0, missed_s=0.0, all_s=0.0)
    for truth, result in zip(truths, results):
        (true, end_s), (found, _) = spans(truth, primitive), spans(result, primitive)
        counts["all_s"] += end_s
        for key in set(true) | set(found):
            ours, theirs = true.get(key, []), found.get(key, [])
            right_s = sum(common(one, other) for one in ours for other in theirs)
            counts["true"] += len(ours)
            counts["found"] += len(theirs)
            counts["right_s"] += right_s
            counts["wrong_s"] += sum(end - start for start, end in theirs) - right_s
            counts["missed_s"] += sum(end - start for start, end in ours) - right_s
            for one in ours:
                half = any(3 * common(one, it) >= one[1] - one[0] + it[1] - it[0] for it in theirs)
                counts["matched"] += half
    return counts


def prepared(program, folder, name):
    """The labeled recordings of a primitive, the folder of their labels, and other recordings."""
    _, scene, operator, variation = PRIMITIVES[name]
    operator = operator or varying(own_rules(name).with_name(f"{name}.operator.yaml"), folder)
    shown, new = (
        [teach(program, scene, operator, seed, variation, folder / f"{name}_{seed}.csv") for seed in seeds]
        for seeds in (SHOWN, NEW)
    )
    (folder / "labels").mkdir(exist_ok=True)
    for log, file in zip(shown, labels(program, shown, own_rules(name), folder / "own")):
        (folder / "labels" / f"{log.stem}.labels.csv").write_text(file.read_text())
    return shown, folder / "labels", new


def own_rules(name):
    return ROOT / "examples" / "primitives" / name / f"{name}.rules"


def measured(program, folder, name, judged):
    """Prints the row of a primitive."""
    folder.mkdir(parents=True, exist_ok=True)
    shown, labeled, new = prepared(program, folder, name)
    declaration = PRIMITIVES[name][0]
    primitive = declaration.split("(")[0]
    base = "bimanual.rules" if name in TWO_HANDS else "contact.rules"
    learned = folder / "learned.rules"
    words = ["learn", *shown, "--labels", labeled, "--rules", base, "--hand", "hand_force.rules"]
    said = run(program, *words, "--new", declaration, "--anyway", "-o", learned, expected=(0, 1))

    def results(kind, logs):
        own = labels(program, logs, own_rules(name), folder / f"own_{kind}")
        return compared(own, labels(program, logs, learned, folder / f"learned_{kind}"), primitive)

    on_new, succeeding, failing = results("new", new), *(results("judged", logs) for logs in judged)
    time_s = on_new["right_s"] + on_new["wrong_s"] + on_new["missed_s"]
    wrong_s, all_s, true, found, matched = (
        succeeding[what] + failing[what] for what in ("wrong_s", "all_s", "true", "found", "matched")
    )
    choice = next(line.split("//")[0].strip() for line in learned.read_text().splitlines() if "// learned:" in line)
    print(
        f"| `{primitive}` | `{choice}` | {'yes' if 'proved: it only adds' in said else 'no'} "
        f"| {on_new['matched']} of {on_new['true']}, {on_new['found'] - on_new['matched']} "
        f"| {100 * on_new['right_s'] / max(time_s, 1e-9):.0f} % "
        f"| {100 * wrong_s / all_s:.2f} % | {100 * failing['wrong_s'] / failing['all_s']:.2f} % "
        f"| {matched} of {true}, {found - matched} |",
        flush=True,
    )


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    program, folder = sys.argv[1], Path(sys.argv[2])
    judged = shipped(program, folder / "shipped")
    print("| primitive | choice | additive | new: found, others | overlap | shipped: false time | of failing ones | found, others |")
    print("|---|---|---|---|---|---|---|---|")
    for name in sys.argv[3:] or PRIMITIVES:
        measured(program, folder / name, name, judged)


if __name__ == "__main__":
    main()
