#!/usr/bin/env python3
"""Runs `init --yes` and `analyze` without options on recordings, and compares the tasks with those that each recording is known to have.

    python3 tools/measure_init.py target/release/teachtree [--only TEXT] [FOLDER…]

It prints the table of docs/measurements/init.md. The tasks are those that the shipped binding of a recording finds, or those listed here. Recordings that are
neither in the repository nor in a FOLDER are left out. `equal time` is the share of the time in which both have the same primitive. `nearly` means that one line makes the guess right: the script writes it and analyzes again.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PICK = {"right": ["pick_and_place"]}
RECORDINGS = [
    # Recordings, and the tasks that they are known to have. Those of shared folders are not in the repository (docs/project.md).
    ("examples/plug_into_socket/plug_1.csv", "examples/plug_into_socket/plug.binding.yaml"),
    ("examples/plug_into_socket/plug_2.csv", "examples/plug_into_socket/plug.binding.yaml"),
    ("examples/contact_flags/box.csv", "examples/contact_flags/box.binding.yaml"),
    ("examples/hand_over/hand_over_1.csv", "examples/hand_over/hand_over.binding.yaml"),
    ("examples/hand_over/hand_over_2.csv", "examples/hand_over/hand_over.binding.yaml"),
    ("examples/motion_capture/box.csv", "examples/motion_capture/box.binding.yaml"),
    ("examples/ros2_bag/insertion", "examples/ros2_bag/insertion.binding.yaml"),
    ("examples/so101_joints/pick_block#0", "examples/so101_joints/so101.binding.yaml"),
    ("examples/lerobot_live/episode.mcap", "examples/lerobot_live/lerobot.binding.yaml"),
    ("demos/robosuite/SawyerNutAssembly_demo_1.csv", "demos/robosuite/sawyer_nut_assembly.binding.yaml"),
    ("demos/robosuite/SawyerStack_demo_1.csv", "demos/robosuite/sawyer_stack.binding.yaml"),
    ("demos/robosuite/stack_panda_demo_1.csv", "demos/robosuite/panda_stack.binding.yaml"),
    ("demos/robosuite/nut_assembly_panda_demo_1.csv", "demos/robosuite/panda_nut_assembly.binding.yaml"),
    ("demos/robosuite/SawyerLift_demo_1.csv", "demos/robosuite/sawyer_lift.binding.yaml"),
    ("demos/robosuite/lift_demo_1.csv", "demos/robosuite/panda_lift.binding.yaml"),
    ("demos/robosuite/lift.hdf5#1", "demos/robosuite/lift_hdf5.binding.yaml"),
    ("demos/robosuite/lift.hdf5#3", "demos/robosuite/lift_hdf5.binding.yaml"),
    ("demos/robosuite/SawyerPickPlace_demo_1.csv", "demos/robosuite/sawyer_pick_place.binding.yaml"),
    ("demos/robosuite/door_panda_demo_1.csv", "demos/robosuite/door.binding.yaml"),
    ("demos/robosuite/handover_panda_panda_demo_5.csv", "demos/robosuite/handover.binding.yaml"),
    ("demos/robosuite/BaxterLift_demo_1.csv", "demos/robosuite/baxter_lift.binding.yaml"),
    ("demos/robosuite/BaxterPegInHole_demo_1.csv", "demos/robosuite/baxter_peg_in_hole.binding.yaml"),
    ("demos/robosuite/wipe_panda_demo_1.csv", "demos/robosuite/wipe.binding.yaml"),
    ("demos/dapg_door/door_00.csv", "demos/bindings/dapg_door.binding.yaml"),
    ("demos/dapg_door/door_03.csv", "demos/bindings/dapg_door.binding.yaml"),
    ("demos/dfki_hand/recording_excerpt.tsv", "demos/bindings/dfki_hand.binding.yaml"),
    # One scripted motion in the layouts of other programs: a gripper takes a cube, carries it and puts it down.
    ("tests/fixtures/init/robomimic.hdf5#demo_1", PICK),
    ("tests/fixtures/init/libero.hdf5", PICK),
    ("tests/fixtures/init/aloha.hdf5", PICK),
    ("tests/fixtures/init/ur_rtde.csv", PICK),
    ("tests/fixtures/init/franka.csv", PICK),
    ("tests/fixtures/init/optitrack.csv", PICK),
    ("tests/fixtures/init/lerobot_v21", PICK),
    ("tests/fixtures/init/lerobot_v30", PICK),
    ("tests/fixtures/init/bag.mcap", PICK),
    ("tests/fixtures/init/replay.zarr", PICK),
    # Recordings of others that are not in the repository.
    ("dapg_door/door_01.csv", "demos/bindings/dapg_door.binding.yaml"),
    ("dapg_door/door_02.csv", "demos/bindings/dapg_door.binding.yaml"),
    ("robosuite/BaxterLift_demo_1.csv", "demos/robosuite/baxter_lift.binding.yaml"),
    ("robosuite/BaxterPegInHole_demo_1.csv", "demos/robosuite/baxter_peg_in_hole.binding.yaml"),
    ("robosuite/SawyerLift_demo_1.csv", "demos/robosuite/sawyer_lift.binding.yaml"),
    ("robosuite/SawyerNutAssembly_demo_1.csv", "demos/robosuite/sawyer_nut_assembly.binding.yaml"),
    ("robosuite/SawyerStack_demo_1.csv", "demos/robosuite/sawyer_stack.binding.yaml"),
    ("robosuite/door_panda_demo_1.csv", "demos/robosuite/door.binding.yaml"),
    ("robosuite/lift_demo_1.csv", "demos/robosuite/panda_lift.binding.yaml"),
    ("robosuite/stack_panda_demo_1.csv", "demos/robosuite/panda_stack.binding.yaml"),
    ("robosuite/wipe_panda_demo_1.csv", "demos/robosuite/wipe.binding.yaml"),
    ("robosuite/handover_panda_panda_demo_0.csv", "demos/robosuite/handover.binding.yaml"),
    ("robosuite/handover_panda_panda_demo_1.csv", "demos/robosuite/handover.binding.yaml"),
    ("dfki_hand/recording.tsv", "demos/bindings/dfki_hand.binding.yaml"),
    *((f"desk_yumi/S{person}_T{trial}.csv", "demos/bindings/desk_yumi.binding.yaml") for person in range(2, 7) for trial in range(1, 7)),
    ("icsc_hmm/wiping_rim_2.csv", "demos/bindings/icsc_wiping.binding.yaml"),
    ("icsc_hmm/wiping_circular_0.csv", "demos/bindings/icsc_wiping.binding.yaml"),
    ("icsc_hmm/wiping_rim_4.csv", "demos/bindings/icsc_wiping.binding.yaml"),
    ("icsc_hmm/wiping_fender_1.csv", "demos/bindings/icsc_wiping.binding.yaml"),
    ("icsc_hmm/peeling_0.csv", "demos/bindings/icsc_peeling.binding.yaml"),
    ("hiro_snap/S-02", "demos/bindings/hiro_snap.binding.yaml"),
    ("hiro_snap/S-05", "demos/bindings/hiro_snap.binding.yaml"),
    ("hiro_snap/S-10", "demos/bindings/hiro_snap.binding.yaml"),
    ("hiro_snap/S-30", "demos/bindings/hiro_snap.binding.yaml"),
    ("hiro_snap/ERROR-02", "demos/bindings/hiro_snap.binding.yaml"),
    ("hiro_snap/ERROR-05", "demos/bindings/hiro_snap.binding.yaml"),
    # The cases: the motion of most is one pick and place.
    ("base/log.csv", PICK),
    ("ati_counts/log_N.csv", "ati_counts/b.yaml"),
    ("ati_header/log.csv", "ati_header/b.yaml"),
    ("bag_tf_equal_stamps/log.mcap", PICK),
    ("bag_joints_equal_stamps/log.mcap", PICK),
    ("bag_tf_tree/log.mcap", PICK),
    ("bag_two_drivers/log.mcap", PICK),
    ("fox_json/log.mcap", PICK),
    ("five_hz/log.csv", PICK),
    ("float32_stamps/log.csv", PICK),
    ("greek_mu/greek.csv", PICK),
    ("h5_one_longer/log.h5", PICK),
    ("h5_userblock/log.h5", PICK),
    ("lr_5fps/set", PICK),
    ("lr_name_to_index/set", PICK),
    ("matlab73/log.mat", PICK),
    ("occlusion_zeros/log.csv", PICK),
    ("plotjuggler/log.csv", PICK),
    ("object_without_pose/log.csv", PICK),
]
LINES = {
    "examples/plug_into_socket/plug_2.csv": (
        "scene",
        "bodies:",
        "bodies:\n  socket: {role: socket, position: [90 mm, 20 mm, 80 mm], sockets: {hole: {rim: [0 m, 0 m, 0 m], axis: [0, 0, 1], radius: 15 mm, depth: 40 mm}}}",
    ),
    "demos/dfki_hand/recording_excerpt.tsv": ("scene", "  pillow:", "  pillow: {role: object, radius: 170 mm}"),
    "dfki_hand/recording.tsv": ("scene", "  pillow:", "  pillow: {role: object, radius: 170 mm}"),
}
"""By recording: the file (`binding` or `scene`), a part of the line that is replaced (a new first line without it), and the line."""


def found(places, name):
    file = name.split("#")[0]
    place = next((place for place in places if (place / file).exists()), None)
    return place and str((place / name).resolve())


def error(output):
    line = next((line for line in output.stderr.splitlines() if "error" in line), "no analysis")
    return line.replace("|", "/")


def analyzed(program, folder, log, *options):
    """The tasks of each hand as a text, without spans that no task explains, and the segments of each track; the error of an analysis that fails, and none."""
    output = subprocess.run([program, "analyze", log, "--format", "json", *options], cwd=folder, capture_output=True, text=True)
    try:
        tracks = json.loads(output.stdout)["tracks"]
    except ValueError:
        return error(output), {}
    named = {track["track"]: [task["task"] for task in track["tasks"] if task["task"] != "unknown"] for track in tracks}
    return text(named), {track["track"]: track["relabeled"] for track in tracks}


def text(named):
    return "; ".join(f"{hand}: {', '.join(all)}" for hand, all in sorted(named.items()) if all) or "none"


def equal_share(truth, found):
    """The share of the time of the true segments in which the other ones have the same primitive."""
    whole = same = 0.0
    for track, segments in truth.items():
        for one in segments:
            whole += one["end_s"] - one["start_s"]
            for other in found.get(track, []):
                both = min(one["end_s"], other["end_s"]) - max(one["start_s"], other["start_s"])
                same += max(both, 0.0) * (one["primitive"] == other["primitive"])
    return same / whole if whole else None


def guessed(program, log, line):
    """The tasks by the files of `init`, and those after one line was changed."""
    with tempfile.TemporaryDirectory() as folder:
        output = subprocess.run([program, "init", log, "--yes", "-o", "."], cwd=folder, capture_output=True, text=True)
        if output.returncode == 2:
            return (error(output), {}), None
        first = analyzed(program, folder, log)
        if line is None:
            return first, None
        kind, old, new = line
        file = next(pathlib.Path(folder).glob(f"*.{kind}.yaml"))
        lines = file.read_text().splitlines()
        lines = [new, *lines] if old is None else [new if old in one else one for one in lines]
        file.write_text("\n".join(lines) + "\n")
        return first, analyzed(program, folder, log)


def is_right(expected, found):
    """The same tasks; without any, nine tenths of the time in the same primitives."""
    share = equal_share(expected[1], found[1])
    return expected[0] == found[0] and (expected[0] != "none" or share is not None and share >= 0.9)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folders", nargs="*", type=pathlib.Path)
    parser.add_argument("--only", default="")
    options = parser.parse_intermixed_args()
    program, places = str(options.program.resolve()), [ROOT, *options.folders]
    counts = {"right": 0, "nearly": 0, "wrong": 0, "not here": 0}
    print("| recording | tasks | tasks by `init` | equal time | verdict |\n|---|---|---|---:|---|")
    for name, truth in RECORDINGS:
        if options.only not in name:
            continue
        log = found(places, name)
        if log is None:
            counts["not here"] += 1
            continue
        if isinstance(truth, str):
            expected = analyzed(program, ROOT, log, "--binding", found(places, truth))
        else:
            expected = text(truth), {}
        line = LINES.get(name)
        first, corrected = guessed(program, log, line)
        share = equal_share(expected[1], first[1])
        verdict = "right" if is_right(expected, first) else "nearly" if corrected and is_right(expected, corrected) else "wrong"
        counts[verdict] += 1
        note = f": `{line[2].splitlines()[-1].strip()}`" if verdict == "nearly" else ""
        shown = "" if share is None else f"{share:.0%}".replace("%", " %")
        print(f"| `{name}` | {expected[0]} | {first[0]} | {shown} | {verdict}{note} |", flush=True)
    print("\n" + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()))


if __name__ == "__main__":
    main()
