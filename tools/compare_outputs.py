#!/usr/bin/env python3
"""Compares every output of two versions of the program on the shipped recordings and scenes.

    tools/compare_outputs.py collect PROGRAM FOLDER [--scenes NAME,NAME] [--quick]
    tools/compare_outputs.py compare OLD_FOLDER NEW_FOLDER

`collect` runs all commands of PROGRAM in the root of the repository and writes each output to a file of FOLDER.
`compare` reports, for two such folders: JSON documents by key (renamed keys of RENAMED are mapped first, new keys are listed and have to
be in ADDED, changed values are errors), tables by column, texts by the numbers that stand in them. Exit status 1 when a value has changed.
Only the standard library of Python is needed.
"""

import argparse
import csv
import io
import json
import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Real recordings with the binding of each.
RECORDINGS = {
    "robosuite/SawyerLift_demo_1.csv": "robosuite/sawyer_lift",
    "robosuite/SawyerNutAssembly_demo_1.csv": "robosuite/sawyer_nut_assembly",
    "robosuite/SawyerPickPlace_demo_1.csv": "robosuite/sawyer_pick_place",
    "robosuite/SawyerStack_demo_1.csv": "robosuite/sawyer_stack",
    "robosuite/BaxterLift_demo_1.csv": "robosuite/baxter_lift",
    "robosuite/BaxterPegInHole_demo_1.csv": "robosuite/baxter_peg_in_hole",
    "robosuite/door_panda_demo_1.csv": "robosuite/door",
    "robosuite/handover_panda_panda_demo_5.csv": "robosuite/handover",
    "robosuite/lift_demo_1.csv": "robosuite/panda_lift",
    "robosuite/nut_assembly_panda_demo_1.csv": "robosuite/panda_nut_assembly",
    "robosuite/stack_panda_demo_1.csv": "robosuite/panda_stack",
    "robosuite/wipe_panda_demo_1.csv": "robosuite/wipe",
    "dapg_door/door_00.csv": "bindings/dapg_door",
    "dapg_door/door_03.csv": "bindings/dapg_door",
    "dfki_hand/recording_excerpt.tsv": "bindings/dfki_hand",
}

# Keys of the old program with the names that the new one gives them, and values that are meant to differ.
RENAMED = {
    "relabelled": "relabeled", "taught_start_s": "demonstrated_start_s", "worth": "objective", "not_told": "undetectable",
}
MEANT = {"schema", "version", "created_by"}
# Keys and columns that the new program writes in addition; others that are new are errors.
ADDED = {
    "object", "partner", "start_row", "end_row", "rows", "name", "start_s", "zero_stamp_s", "version", "digest", "files",
    "rules",
}

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.]*\d)")


def collect(program, folder, scenes, quick):
    folder.mkdir(parents=True, exist_ok=True)
    program = Path(program).resolve()

    def run(name, *args, file=None):
        """Runs a command; its standard output becomes a file called `name`, unless the command writes `file`."""
        done = subprocess.run([program, *map(str, args)], cwd=ROOT, capture_output=True, timeout=1800)
        out = folder / name
        if file is None:
            out.write_bytes(done.stdout)
        (folder / f"{name}.status").write_text(f"{done.returncode}\n")
        # Messages are free to change; they are kept to be read.
        (folder / f"{name}.stderr").write_bytes(done.stderr)

    def of_log(name, log, options):
        for form in ["text", "json"]:
            run(f"{name}.inspect.{form}", "inspect", log, *options, "--format", form)
        for form in ["text", "json", "csv"]:
            run(f"{name}.analyze.{form}", "analyze", log, *options, "--format", form)
        table = csv.DictReader((folder / f"{name}.analyze.csv").read_text().splitlines())
        middles = [(float(row["start_s"]) + float(row["end_s"])) / 2 for row in table] or [1.0]
        for share in [0.3, 0.6]:
            at = f"{middles[int(share * (len(middles) - 1))]:.3f}s"
            run(f"{name}.explain_{share}.json", "explain", log, *options, "--at", at, "--format", "json")
            run(f"{name}.explain_{share}.text", "explain", log, *options, "--at", at)
            why_not = ["--at", at, "--why-not", "Translate"]
            run(f"{name}.why_not_{share}.json", "explain", log, *options, *why_not, "--format", "json")
            run(f"{name}.graph_{share}.text", "graph", "--log", log, *options, "--at", at)
        run(f"{name}.diff.text", "diff", "contact.rules", "examples/tap.rules", log, *options)

    for log, binding in RECORDINGS.items():
        options = ["--binding", f"demos/{binding}.binding.yaml"]
        of_log(Path(log).stem, f"demos/{log}", options)

    # Recordings lie where both versions call them the same.
    taught = Path("target/compared")
    (ROOT / taught).mkdir(parents=True, exist_ok=True)
    for scene in scenes:
        log, commands, robot = (taught / f"{scene}.csv", taught / f"{scene}.commands.json", taught / f"{scene}.robot.csv")
        run(f"{scene}.teach.text", "teach", scene, scene, "-o", log, "--seed", "3")
        of_log(scene, log, [])
        run(f"{scene}.score.json", "score", log, "--format", "json")
        run(f"{scene}.score.text", "score", log)
        for made in [log, log.with_suffix(".scene.yaml"), log.with_suffix(".events.csv")]:
            if (ROOT / made).exists():
                (folder / f"{scene}.recording.{made.name}").write_bytes((ROOT / made).read_bytes())
        run(f"{scene}.command.text", "command", log, "-o", commands)
        run(f"{scene}.command_table.text", "command", log, "--format", "csv", "-o", taught / f"{scene}.commands.csv")
        run(f"{scene}.simulate.text", "simulate", commands, "--scene", log.with_suffix(".scene.yaml"), "-o", robot)
        for made in [commands, taught / f"{scene}.commands.csv", robot]:
            if (ROOT / made).exists():
                (folder / f"{scene}.robot.{made.name}").write_bytes((ROOT / made).read_bytes())

    run("check.text", "check")
    run("check.json", "check", "--format", "json")
    run("check_two_hands.text", "check", "rules/bimanual.rules")
    run("check_hold.json", "check", "examples/hold.rules", "--format", "json")
    run("fmt.text", "fmt", "--check", "rules", "examples")
    for form in ["text", "dot", "mermaid", "svg"]:
        run(f"graph.{form}", "graph", "--format", form)
    run("graph.transitions.text", "graph", "--transitions")
    run("prove.text", "prove", "additive", "contact.rules", "examples/tap.rules")
    run("diff.text", "diff", "contact.rules", "examples/tap.rules")
    if not quick and scenes:
        run("fit.text", "fit", taught / f"{scenes[0]}.csv", "--params", "touch_on,touch_off", "--anyway")


def flat(value, path=""):
    """All leaves of a document, with the path of each."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flat(inner, f"{path}.{RENAMED.get(key, key)}")
    elif isinstance(value, list):
        for at, inner in enumerate(value):
            yield from flat(inner, f"{path}[{at}]")
    else:
        yield path, value


def documents(text):
    """One document, or one a line."""
    try:
        return [json.loads(text)]
    except json.JSONDecodeError:
        return [json.loads(line) for line in text.splitlines() if line.strip()]


def general(path):
    return re.sub(r"\[\d+\]", "[]", path)


def compare_json(old, new, added, gone):
    changes = []
    try:
        old, new = documents(old), documents(new)
    except json.JSONDecodeError:
        return ["one of the two is not JSON"]
    if len(old) != len(new):
        return [f"{len(old)} documents became {len(new)}"]
    old, new = dict(flat(old)), dict(flat(new))
    for path, value in old.items():
        if path.rsplit(".", 1)[-1] in MEANT:
            continue
        if path not in new:
            gone[general(path)] += 1
        elif new[path] != value:
            changes.append(f"{path}: {value!r} became {new[path]!r}")
    for path in new.keys() - old.keys():
        added[general(path)] += 1
    return changes


def compare_csv(old, new, added, gone):
    def columns(text):
        rows = [row for row in csv.reader(io.StringIO(text)) if row and not row[0].startswith("#")]
        return {title: [row[at] if at < len(row) else None for row in rows[1:]] for at, title in enumerate(rows[0] if rows else [])}

    old, new, changes = columns(old), columns(new), []
    for title, values in old.items():
        title = RENAMED.get(title, title)
        if title not in new:
            gone[f"column {title}"] += 1
        elif new[title] != values:
            changes.append(f"column {title} has other values")
    for title in new.keys() - old.keys():
        added[f"column {title}"] += 1
    return changes


def compare(old_folder, new_folder):
    names = sorted({path.name for folder in [old_folder, new_folder] for path in folder.iterdir()})
    names = [name for name in names if not name.endswith(".stderr")]
    added, gone, counts, changed = Counter(), Counter(), Counter(), False
    for name in names:
        old, new = old_folder / name, new_folder / name
        if not (old.exists() and new.exists()):
            print(f"{name}: only the {'old' if old.exists() else 'new'} program wrote it")
            changed = True
            continue
        old, new = old.read_bytes(), new.read_bytes()
        if old == new:
            counts["equal byte for byte"] += 1
            continue
        old, new = old.decode(errors="replace"), new.decode(errors="replace")
        if name.endswith(".json"):
            changes = compare_json(old, new, added, gone)
        elif name.endswith(".csv"):
            changes = compare_csv(old, new, added, gone)
        elif name.endswith(".status"):
            changes = [f"exit status {old.strip()} became {new.strip()}"]
        else:
            before, after = NUMBER.findall(old), NUMBER.findall(new)
            changes = [] if before == after else [f"numbers: {len(before)} became {len(after)}; first that differs: "
                + next((f"{a} became {b}" for a, b in zip(before, after) if a != b), "one list is longer")]
            counts["texts with other words"] += not changes
        counts["same values" if not changes else "changed"] += 1
        changed |= bool(changes)
        for change in changes[:5]:
            print(f"{name}: {change}")
        if len(changes) > 5:
            print(f"{name}: and {len(changes) - 5} more")
    print("\nkeys that are new:", *(f"  {key} ({count})" for key, count in sorted(added.items())), sep="\n")
    unlisted = sorted(key for key in added if not ADDED & set(re.split(r"[^\w]+", key)))
    if unlisted:
        print("\nof these, not in ADDED:", *(f"  {key}" for key in unlisted), sep="\n")
        changed = True
    print("\nkeys that are gone:", *(f"  {key} ({count})" for key, count in sorted(gone.items())), sep="\n")
    print("\n" + ", ".join(f"{what}: {count}" for what, count in counts.items()), f"of {len(names)} outputs")
    return 1 if changed else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(dest="action", required=True)
    part = parts.add_parser("collect")
    part.add_argument("program")
    part.add_argument("folder", type=Path)
    part.add_argument("--scenes", default=None, help="names, separated by commas; all shipped scenes when left out")
    part.add_argument("--quick", action="store_true", help="leave `fit` out")
    part = parts.add_parser("compare")
    part.add_argument("old", type=Path)
    part.add_argument("new", type=Path)
    args = parser.parse_args()
    if args.action == "compare":
        return compare(args.old, args.new)
    names = sorted(path.name.removesuffix(".operator.yaml") for path in (ROOT / "scenes").glob("*.operator.yaml"))
    names = [name for name in names if (ROOT / "scenes" / f"{name}.yaml").exists()]
    scenes = names if args.scenes is None else [name for name in args.scenes.split(",") if name]
    collect(args.program, args.folder, scenes, args.quick)
    return 0


if __name__ == "__main__":
    sys.exit(main())
