#!/usr/bin/env python3
"""How contact of a tool on a wrist force sensor is found for tools of any mass, sensors of any bias and either sign, by each way to bind them.

A tool moves freely and turns, presses on a table with 8 N, wipes for 0.2 m and leaves, twice; 100 Hz, noise of 0.3 N, and a drift of 0.02 to 0.03 N/s. The truth is
what the script lets the tool do. Prints the frames of contact and of free motion that are right, in percent: the least and the median of twelve recordings of
each mass: four biases, and contact in 25, 32 and 60 % of the time.

    python3 tools/measure_wrist_sensor.py target/release/teachtree        # needs numpy
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

MASSES = [0.0, 0.2, 0.4, 0.8, 1.2]
BIASES = [(2.1, -3.2, 1.4), (0.5, 0.3, -3.0), (0.0, 0.0, 3.0), (-2.0, 1.0, 0.0)]
# How long the tool moves freely before each contact, and how long it presses before it wipes, s.
CASES = [(8.0, 1.65), (4.0, 1.65), (4.0, 12.0)]
RATE_HZ = 100.0
PRESS_N, FRICTION, NOISE_N = 8.0, 0.3, 0.3
DRIFT_N_S = np.array([0.02, -0.01, 0.03])
LEARNED = "sensors: {right.palm.force: {frame: right.palm.rotation, tool: learned}}"
WAYS = {
    "plain": ("", ""),
    "tare": ("", "tare: {channels: [right.palm.force], from: 0 s, to: 1.5 s}"),
    "tool: learned": ("", LEARNED),
    "tool: learned, other sign": ("-", LEARNED),
}


def eased(share):
    """Minimum jerk from 0 to 1."""
    share = np.clip(share, 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def between(knots, time):
    """Values at times, with minimum jerk from each knot (time, vector) to the next."""
    stamps = np.array([stamp for stamp, _ in knots])
    values = np.array([value for _, value in knots], float)
    at = np.clip(np.searchsorted(stamps, time, side="right") - 1, 0, len(stamps) - 2)
    share = eased((time - stamps[at]) / np.maximum(stamps[at + 1] - stamps[at], 1e-9))
    return values[at] + (values[at + 1] - values[at]) * share[:, None]


def rotations(roll, pitch, yaw):
    """Matrices of turns about the fixed axes x, then y, then z."""
    (cr, sr), (cp, sp), (cy, sy) = [(np.cos(angle), np.sin(angle)) for angle in (roll, pitch, yaw)]
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.array(rows).transpose(2, 0, 1)


def quaternion(roll, pitch, yaw):
    """The same as w x y z."""
    (cr, sr), (cp, sp), (cy, sy) = [(np.cos(angle / 2), np.sin(angle / 2)) for angle in (roll, pitch, yaw)]
    w = cr * cp * cy + sr * sp * sy
    x = sr * cp * cy - cr * sp * sy
    y = cr * sp * cy + sr * cp * sy
    z = cr * cp * sy - sr * sp * cy
    return np.stack([w, x, y, z], -1)


def record(folder, mass, bias, free_s, press_s, seed):
    """Writes a recording and its labels."""
    chance = np.random.default_rng(seed)
    place, turn, contacts, clock = [(0.0, (0.35, -0.1, 0.25))], [(0.0, (0.0, 0.0, 0.0))], [], 0.0

    def go(takes_s, to, turned):
        nonlocal clock
        clock += takes_s
        place.append((clock, to))
        turn.append((clock, turned))

    go(2.0, (0.35, -0.1, 0.25), (0.0, 0.0, 0.0))
    for x in (0.45, 0.5):
        go(free_s / 2, (x, -0.1, 0.22), (0.6, -0.42, 0.4))
        go(free_s / 2, (x, -0.1, 0.12), (0.05, 0.0, 0.0))
        go(1.2, (x, -0.1, 0.0), (0.0, 0.0, 0.0))
        begins = clock
        go(press_s, (x, -0.1, -0.002), (0.0, 0.0, 0.0))
        go(2.6, (x, 0.1, -0.002), (0.0, 0.0, 0.0))
        go(0.4, (x, 0.1, 0.0), (0.0, 0.0, 0.0))
        contacts.append((begins, clock))
        go(1.2, (x, 0.1, 0.12), (0.0, 0.0, 0.0))
        go(1.5, (0.35, -0.1, 0.25), (-0.48, 0.3, -0.5))
    go(2.0, (0.35, -0.1, 0.25), (0.0, 0.0, 0.0))
    time = np.arange(0.0, clock, 1.0 / RATE_HZ)
    tip = between(place, time)
    roll, pitch, yaw = between(turn, time).T
    # z of the sensor points down.
    roll = roll + np.pi
    speed = np.gradient(tip, 1.0 / RATE_HZ, axis=0)
    force_on_tool = np.zeros((len(time), 3))
    for begins, ends in contacts:
        force = PRESS_N * eased((time - begins) / 0.15) * eased((ends - time) / 0.1)
        force_on_tool[:, 2] += force
        force_on_tool[:, 1] -= FRICTION * force * np.sign(speed[:, 1]) * (np.abs(speed[:, 1]) > 1e-3)
    weight = mass * (np.array([0.0, 0.0, -9.81]) - np.gradient(speed, 1.0 / RATE_HZ, axis=0))
    in_sensor = np.einsum("nji,nj->ni", rotations(roll, pitch, yaw), force_on_tool + weight)
    # The force on the object, as bindings want it.
    read = -in_sensor + np.array(bias) + np.outer(time, DRIFT_N_S) + chance.normal(0.0, NOISE_N, (len(time), 3))
    columns = np.column_stack([time, read, tip, quaternion(roll, pitch, yaw)])
    header = "t,Fx,Fy,Fz,px,py,pz,qw,qx,qy,qz"
    np.savetxt(folder / "log.csv", columns, delimiter=",", header=header, comments="", fmt="%.5f")
    edges = [0.0, *[edge for contact in contacts for edge in contact], time[-1]]
    rows = [
        f"{'contact' if at % 2 else 'free'},{start},{end},right" for at, (start, end) in enumerate(zip(edges, edges[1:]))
    ]
    (folder / "labels.csv").write_text("label,start_s,end_s,track\n" + "\n".join(rows) + "\n")


def right(program, folder, sign, correction):
    """The share of the frames that are right, percent."""
    (folder / "binding.yaml").write_text(
        f"""hand_file: hand_wrist.rules
time: t [s]
channels:
  right.palm.position: p<xyz> [m]
  right.palm.rotation: q<wxyz>
  right.palm.force: {sign}F<xyz> [N]
  tool.position: p<xyz> [m]
  tool.rotation: q<wxyz>
{correction}
scene: {{bodies: {{tool: {{role: object, radius: 30 mm, fixed_to: right}}, table: {{role: support}}}}}}
"""
    )
    names = "free=Move|Approach|Release,contact=Press|Trace"
    files = ["log.csv", "--binding", "binding.yaml", "--labels", "labels.csv", "--map", names, "--format", "json"]
    done = subprocess.run([program, "score", *files], cwd=folder, capture_output=True, text=True, check=True)
    return 100.0 * json.loads(done.stdout)["results"][0]["all"]["accuracy"]


def main():
    program = str(Path(sys.argv[1] if len(sys.argv) > 1 else "target/release/teachtree").resolve())
    print("| mass | " + " | ".join(WAYS) + " |\n|---|" + "---|" * len(WAYS))
    for mass in MASSES:
        found = {way: [] for way in WAYS}
        for number, (bias, case) in enumerate((bias, case) for bias in BIASES for case in CASES):
            with tempfile.TemporaryDirectory() as name:
                record(Path(name), mass, bias, *case, number)
                for way, (sign, correction) in WAYS.items():
                    found[way].append(right(program, Path(name), sign, correction))
        cells = [f"{min(shares):.1f} %, {np.median(shares):.1f} %" for shares in found.values()]
        print(f"| {mass:.1f} kg | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
