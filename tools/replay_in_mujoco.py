#!/usr/bin/env python3
"""Executes robot programs in MuJoCo, with MuJoCo's own contacts, and compares the results with those of `teachtree simulate`.

    python3 -m venv venv && venv/bin/pip install mujoco numpy pyyaml
    venv/bin/python tools/replay_in_mujoco.py --teachtree target/release/teachtree pick_and_place slide
    venv/bin/python tools/replay_in_mujoco.py --teachtree target/release/teachtree --seed 2 --view pick_and_place

For each shipped scene, the program demonstrates, retargets and simulates; the robot is `both_hands`. The exported joint trajectory is then tracked in
MuJoCo by position actuators, with the fingertip forces of the simulated robot as feedforward torques. The trajectory may be slower than the simulation; both
are aligned by dynamic time warping of the fingertips. A hand that holds an object by itself moves by the integral of the object's pose error, as the simulated
robot does; `--open-loop` leaves this out. All links touch bodies; links do not touch each other. A screw in its thread moves on an ideal helix.

The output has a row for each task: the distance of the object from its demonstrated final pose in both simulations. A task is done within 5 mm and 3 degrees;
in a hole, a turn about its axis does not count.
"""

import argparse
import csv
import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import mujoco
import mujoco.viewer
import numpy as np
import yaml

ROOT = Path(__file__).resolve().parent.parent
UNITS = {"mm": 1e-3, "m": 1.0, "kg": 1.0, "g": 1e-3, "deg": math.pi / 180, "rad": 1.0, "s": 1.0, "N": 1.0, "": 1.0}
WITHIN_M, WITHIN_DEG = 0.005, 3.0
STEP_S, SETTLING_S = 0.001, 0.3
# The stiffness of position actuators: natural frequency (rad/s) of arm joints, and stiffness (N m/rad) and damping (N m s/rad) of finger joints.
ARM_OMEGA = 60.0
FINGER = (1.5, 0.03)
# Friction of fingertips, and the radius of their contact patch (m), as in the simulation.
TIP_FRICTION, PATCH_M = 1.0, 0.004
# Friction of a thread, N m, as in the simulation.
THREAD_FRICTION_NM = 0.003
# Pose correction, as in the simulation: integral gain and decay after release (1/s), largest correction (rad, m).
CORRECTION_RATE, CORRECTION_DECAY, CORRECTION_RAD, CORRECTION_M = 2.0, 4.0, 0.35, 0.02


def si(value):
    """A number with or without a unit, in SI."""
    if isinstance(value, (int, float)):
        return float(value)
    number, unit = re.match(r"\s*([-+0-9.e]+)\s*(.*)", str(value)).groups()
    return float(number) * UNITS.get(unit.split()[0] if unit else "", 1.0)


def vector(value, size=3):
    return [si(part) for part in value] if value is not None else [0.0] * size


def words(values):
    return " ".join(f"{value:.9g}" for value in values)


def rotation(value):
    return [float(part) for part in value] if value is not None else [1.0, 0.0, 0.0, 0.0]


def shape(part, attributes):
    """A geom of a part of a body or link."""
    at, turned = np.array(vector(part.get("at"))), np.array(rotation(part.get("turned")))
    if "box" in part:
        size = f'type="box" size="{words(edge / 2 for edge in vector(part["box"]))}"'
    elif "cylinder" in part:
        radius, height = vector(part["cylinder"])
        size = f'type="cylinder" size="{radius:.9g} {height / 2:.9g}"'
    elif "ball" in part:
        size = f'type="sphere" size="{si(part["ball"]):.9g}"'
    else:
        length, radius = vector(part["capsule"])
        end = np.zeros(3)
        mujoco.mju_rotVecQuat(end, np.array([length, 0.0, 0.0]), turned)
        return f'<geom type="capsule" size="{radius:.9g}" fromto="{words([*at, *(at + end)])}" {attributes}/>'
    return f'<geom {size} pos="{words(at)}" quat="{words(turned)}" {attributes}/>'


def threads(scene):
    """The screws of a scene: name, axis of the thread in the reference frame, pitch in m. A screw begins in its thread."""
    sockets = [socket for body in scene["bodies"].values() for socket in body.get("sockets", {}).values()]
    return {name: (vector(socket["axis"]), si(socket["pitch"])) for socket in sockets if "pitch" in socket for name in socket["accepts"]}


def scene_bodies(scene):
    """The bodies of a scene. A contact takes the larger friction of both geoms, where the simulation takes the mean: they differ in `stamp`, `slide` and
    `turn_screw` only."""
    text, screws = "", threads(scene)
    for name, body in scene["bodies"].items():
        parts = body.get("parts", [])
        is_object = body["role"] == "object"
        mass = f'mass="{si(body["mass"]) / len(parts):.9g}"' if is_object else ""
        attributes = f'contype="1" conaffinity="3" friction="{body.get("friction", 0.4)} 0.0001 0.0001" condim="4" {mass}'
        geoms = "".join(shape(part, attributes) for part in parts)
        joint = "<freejoint/>" if is_object else ""
        if name in screws:
            axis = words(screws[name][0])
            joint = f'<joint name="{name}/lift" type="slide" axis="{axis}"/>'
            joint += f'<joint name="{name}/turn" type="hinge" axis="{axis}" frictionloss="{THREAD_FRICTION_NM}"/>'
        place = f'pos="{words(vector(body.get("position")))}" quat="{words(rotation(body.get("rotation")))}"'
        text += f'<body name="{name}" {place}>{joint}{geoms}</body>\n'
    return text


class Robot:
    """The links, joints and fingertips of the parts of a robot file that a trajectory moves."""

    def __init__(self, path, moved):
        assembly = yaml.safe_load(path.read_text())
        parts = assembly.get("parts", {"": {"robot": path.stem}})
        self.links, self.joints, self.tips, self.roots = {}, [], {}, []
        for name, part in parts.items():
            prefix = f"{name}/" if name else ""
            if not any(joint.startswith(prefix) for joint in moved):
                continue
            # YAML 1.1 reads the key `on` as true.
            part["on"] = part.get("on", part.get(True))
            file = yaml.safe_load((path.parent / f"{part['robot']}.yaml").read_text())
            self.links |= {prefix + link: spec for link, spec in file["links"].items()}
            self.roots.append((prefix + file["root"], part))
            for joint, spec in file["joints"].items():
                spec = spec | {"parent": prefix + spec["parent"], "child": prefix + spec["child"]}
                if "coupled" in spec:
                    spec["coupled"] = spec["coupled"] | {"to": prefix + spec["coupled"]["to"]}
                self.joints.append((prefix + joint, spec))
            if "hand" in file:
                hand = file["hand"]
                for finger, spec in hand["fingers"].items():
                    side = name.split("_")[0] if name.split("_")[0] in ("left", "right") else hand["side"]
                    self.tips[f"{side}.{finger}"] = spec | {"link": prefix + spec["link"]}

    def link(self, name, place, joint=""):
        spec = self.links[name]
        parts = spec.get("parts", [])
        mass = si(spec["mass"])
        attributes = f'contype="2" conaffinity="0" mass="{mass / max(len(parts), 1):.9g}" friction="0.5"'
        text = f'<body name="{name}" {place}>{joint}' + "".join(shape(part, attributes) for part in parts)
        if not parts:
            text += f'<inertial pos="0 0 0" mass="{mass:.9g}" diaginertia="{words([mass * 1e-4] * 3)}"/>'
        for tip, finger in self.tips.items():
            if finger["link"] == name:
                text += self.tip(tip, finger)
        for joint_name, spec in self.joints:
            if spec["parent"] == name:
                at = f'pos="{words(vector(spec.get("at")))}" quat="{words(rotation(spec.get("turned")))}"'
                text += self.link(spec["child"], at, joint_text(joint_name, spec))
        for root, part in self.roots:
            if part["on"] == name:
                at = f'pos="{words(vector(part.get("at")))}" quat="{words(rotation(part.get("turned")))}"'
                text += self.link(root, at)
        return text + "</body>\n"

    def tip(self, name, finger):
        """A fingertip: a ball, or a disc of the size of its flat pad."""
        at, radius = np.array(vector(finger["tip"])), si(finger["radius"])
        patch = si(finger.get("pad_radius", PATCH_M))
        contact = f'contype="2" conaffinity="0" mass="0" condim="4" priority="1" friction="{TIP_FRICTION} {2 / 3 * patch:.6g} 0.0001"'
        site = f'<site name="{name}" pos="{words(at)}" size="0.001"/>'
        if "pad_radius" not in finger:
            return site + f'<geom name="{name}" type="sphere" size="{radius:.9g}" pos="{words(at)}" {contact}/>'
        pad = np.array(vector(finger["pad"]))
        ends = [*(at + pad * (radius - 0.004)), *(at + pad * radius)]
        return site + f'<geom name="{name}" type="cylinder" size="{patch:.9g}" fromto="{words(ends)}" {contact}/>'

    def bodies(self):
        fixed = [(root, part) for root, part in self.roots if part["on"] is None]
        at = [f'pos="{words(vector(part.get("at")))}" quat="{words(rotation(part.get("turned")))}"' for _, part in fixed]
        return "".join(self.link(root, place) for (root, _), place in zip(fixed, at))

    def couplings(self):
        coupled = [(name, spec["coupled"]) for name, spec in self.joints if "coupled" in spec]
        return "".join(
            f'<joint joint1="{name}" joint2="{to["to"]}" polycoef="0 {to["ratio"]} 0 0 0" solref="0.004 1"/>'
            for name, to in coupled
        )


def joint_text(name, spec):
    if "axis" not in spec:
        return ""
    slides = "travel" in spec or "slide_speed" in spec
    limits = spec.get("travel" if slides else "range")
    text = f'<joint name="{name}" type="{"slide" if slides else "hinge"}" axis="{words(vector(spec["axis"]))}"'
    if limits:
        text += f' limited="true" range="{words(vector(limits))}"'
    for key, of in [("armature", "armature"), ("damping", "damping"), ("friction", "frictionloss")]:
        if key in spec:
            text += f' {of}="{si(spec[key]):.9g}"'
    return text + "/>"


def model(scene, robot, moved):
    hand = tuple({tip["link"].split("/")[0] for tip in robot.tips.values()})
    actuators = ""
    specs = dict(robot.joints)
    for name in moved:
        limit = si(specs[name].get("torque", specs[name].get("force", 1e3)))
        if name.startswith(hand):
            stiffness, damping = FINGER
        else:
            inertia = si(specs[name].get("armature", 0.05)) + 0.2
            stiffness, damping = inertia * ARM_OMEGA**2, 2 * 0.9 * inertia * ARM_OMEGA
        actuators += f'<position name="{name}" joint="{name}" kp="{stiffness}" kv="{damping}" forcerange="{-limit} {limit}"/>'
    # A tendon, since an equality of both joints is soft where one turns and the other slides.
    helices = "".join(f'<fixed name="{name}/thread"><joint joint="{name}/lift" coef="1"/><joint joint="{name}/turn" coef="{-pitch / math.tau}"/></fixed>'
                      for name, (_, pitch) in threads(scene).items())
    flanks = "".join(f'<tendon tendon1="{name}/thread"/>' for name in threads(scene))
    # Without the iterations against slip, a held object creeps through the fingers: MuJoCo's static friction is a damper.
    return f"""<mujoco><compiler angle="radian" autolimits="true"/>
<option timestep="{STEP_S}" integrator="implicitfast" cone="elliptic" impratio="10" noslip_iterations="10"/>
<worldbody><light pos="0 0 2"/>{scene_bodies(scene)}{robot.bodies()}</worldbody>
<tendon>{helices}</tendon><equality>{robot.couplings()}{flanks}</equality><actuator>{actuators}</actuator></mujoco>"""


class RobotRecording:
    """The recording of the simulated robot: a row each step; SI units, reference frame."""

    def __init__(self, path):
        with path.open() as file:
            rows = list(csv.reader(file))
        titles = [title.split(" ")[0] for title in rows[0]]
        self.values = np.array([[float(cell or "nan") for cell in row] for row in rows[1:]])
        self.columns = {title: number for number, title in enumerate(titles)}
        self.time = self.values[:, 0]

    def column(self, name, time_s):
        return np.interp(time_s, self.time, self.values[:, self.columns[name]])

    def at(self, tip, time_s):
        """The force of a fingertip."""
        return np.array([self.column(f"{tip}.force.{axis}", time_s) for axis in "xyz"])

    def position(self, tip, times):
        """The positions of a fingertip, m."""
        return np.stack([self.column(f"{tip}.position.{axis}", times) for axis in "xyz"], axis=1)

    def pose(self, name, time_s):
        """The position, m, and the unit quaternion of an object."""
        place = np.array([self.column(f"{name}.position.{axis}", time_s) for axis in "xyz"])
        turned = np.array([self.column(f"{name}.rotation.{axis}", time_s) for axis in "wxyz"])
        return place, turned / np.linalg.norm(turned)


class PoseCorrection:
    """Moves the arm of a hand by the integral of the pose error of the object that it holds, against its pose in a recording."""

    def __init__(self, spec, data, side, robot, moved, objects):
        self.spec, self.data = spec, data
        self.tips = {spec.geom(tip).id: tip for tip in robot.tips if tip.startswith(side)}
        # Without an arm, the palm is fixed.
        arm = [name for name in moved if name.startswith(f"{side}_arm/")]
        self.dofs = [spec.joint(name).dofadr[0] for name in arm]
        self.actuators = [spec.actuator(name).id for name in arm]
        self.palm = spec.body(f"{side}_hand/palm").id
        self.objects = {spec.body(name).id: name for name in objects}
        self.turned, self.moved = np.zeros(3), np.zeros(3)

    def touches(self):
        """By object: the fingertips of this hand that touch it, and whether anything else does."""
        found = {body: (set(), False) for body in self.objects}
        for contact in self.data.contact[: self.data.ncon]:
            for geom, other in [(contact.geom1, contact.geom2), (contact.geom2, contact.geom1)]:
                body = self.spec.geom_bodyid[geom]
                if body in found:
                    tips, beside = found[body]
                    found[body] = (tips | {self.tips[other]}, beside) if other in self.tips else (tips, True)
        return found

    def apply(self, recording, time_s):
        """Integrates the error at this time of the recording, and adds the correction to the controls of the arm."""
        held = [(body, tips, touched) for body, (tips, touched) in self.touches().items()
                if len(tips) > 1 and any(tip.endswith(".thumb") for tip in tips)]
        if held:
            body, tips, touched = held[0]
            place, wanted = recording.pose(self.objects[body], time_s)
            inverse, turn, error = np.zeros(4), np.zeros(4), np.zeros(3)
            mujoco.mju_negQuat(inverse, self.data.xquat[body])
            mujoco.mju_mulQuat(turn, wanted, inverse)
            mujoco.mju_quat2Vel(error, turn, 1.0)
            self.turned = within(self.turned + error * CORRECTION_RATE * STEP_S, CORRECTION_RAD)
            if not touched:
                self.moved = within(self.moved + (place - self.data.xpos[body]) * CORRECTION_RATE * STEP_S, CORRECTION_M)
        else:
            tips = self.tips.values()
            self.turned, self.moved = (it * (1.0 - CORRECTION_DECAY * STEP_S) for it in (self.turned, self.moved))
        middle = np.mean([self.data.site(tip).xpos for tip in tips], axis=0)
        shift = np.concatenate([self.moved + np.cross(self.turned, self.data.xpos[self.palm] - middle), self.turned])
        linear, angular = np.zeros((3, self.spec.nv)), np.zeros((3, self.spec.nv))
        mujoco.mj_jacBody(self.spec, self.data, linear, angular, self.palm)
        jacobian = np.vstack([linear, angular])[:, self.dofs]
        # Damped least squares: near a singular posture the correction stays small.
        self.data.ctrl[self.actuators] += jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-6 * np.eye(6), shift)


def within(shift, most):
    """The vector, shortened to this length if it is longer."""
    return shift * min(1.0, most / max(np.linalg.norm(shift), 1e-9))


GRID_S = 0.02
# The cost of a step of the alignment in which only one of both times advances, m: both advance together while the fingertips rest.
STALLS_M = 0.0002


def aligned(fingertips, recording, tips):
    """The times of the recording at which its fingertips are where those of the trajectory are, one for each of its times in steps of GRID_S: dynamic time warping
    (Sakoe and Chiba, 1978). Shape of `fingertips`: times, tips, 3; m."""
    times = np.arange(0.0, recording.time[-1] + GRID_S, GRID_S)
    recorded = np.stack([recording.position(tip, times) for tip in tips], axis=1)
    distances = np.array([np.linalg.norm(recorded - row, axis=2).mean(axis=1) for row in fingertips])
    costs = np.full(distances.shape, np.inf)
    costs[0] = distances[0].cumsum() + STALLS_M * np.arange(len(times))
    for row in range(1, len(costs)):
        entered = np.minimum(costs[row - 1] + STALLS_M, np.concatenate([[np.inf], costs[row - 1][:-1]]))
        cost = np.inf
        for column, (enters, distance) in enumerate(zip(entered.tolist(), distances[row].tolist())):
            cost = min(enters, cost + STALLS_M) + distance
            costs[row, column] = cost
    row, column = costs.shape[0] - 1, costs.shape[1] - 1
    found = np.zeros(len(costs))
    while True:
        found[row] = times[column]
        if row == 0:
            return found
        before = [costs[row - 1, column - 1] if column else np.inf, costs[row - 1, column] + STALLS_M,
                  costs[row, column - 1] + STALLS_M if column else np.inf]
        step = int(np.argmin(before))
        row, column = row - (step != 2), column - (step != 1)


def replay(scene, robot_file, trajectory, recording, view, corrected):
    """Executes a trajectory. Returns the final poses of the objects: position and quaternion."""
    moved = trajectory["joint_names"]
    points = trajectory["points"]
    seconds = lambda point: point["time_from_start"]["sec"] + point["time_from_start"]["nanosec"] * 1e-9
    times = np.array([seconds(point) for point in points])
    positions = np.array([point["positions"] for point in points])
    velocities = np.array([point["velocities"] for point in points])
    robot = Robot(robot_file, moved)
    spec = mujoco.MjModel.from_xml_string(model(scene, robot, moved))
    data = mujoco.MjData(spec)
    joints = [spec.joint(name) for name in moved]
    places, dofs = [joint.qposadr[0] for joint in joints], [joint.dofadr[0] for joint in joints]
    actuators = [spec.actuator(name).id for name in moved]
    ratio = spec.actuator_biasprm[actuators, 2] / spec.actuator_biasprm[actuators, 1]
    coupled = [(spec.joint(name).qposadr[0], spec.joint(joint["coupled"]["to"]).qposadr[0], joint["coupled"]["ratio"])
               for name, joint in robot.joints if "coupled" in joint]

    def place(joints):
        data.qpos[places] = joints
        for follower, leader, ratio in coupled:
            data.qpos[follower] = ratio * data.qpos[leader]

    grid = np.arange(0.0, times[-1] + GRID_S, GRID_S)
    fingertips = []
    for joints in np.stack([np.interp(grid, times, column) for column in positions.T], axis=1):
        place(joints)
        mujoco.mj_kinematics(spec, data)
        fingertips.append([data.site(tip).xpos.copy() for tip in robot.tips])
    recorded_s = aligned(np.array(fingertips), recording, list(robot.tips))
    mujoco.mj_resetData(spec, data)
    place(positions[0])
    robot_dofs = [spec.joint(name).dofadr[0] for name, joint in robot.joints if "axis" in joint]
    fingers = [dof for dof in robot_dofs if spec.joint(int(spec.dof_jntid[dof])).name.startswith(tuple(
        {tip["link"].split("/")[0] for tip in robot.tips.values()}))]
    objects = [name for name, body in scene["bodies"].items() if body["role"] == "object"]
    sides = sorted({tip.split(".")[0] for tip in robot.tips}) if corrected else []
    corrections = [PoseCorrection(spec, data, side, robot, moved, objects) for side in sides]
    viewer = None
    if view:
        viewer = mujoco.viewer.launch_passive(spec, data)
    jacobian = np.zeros((3, spec.nv))
    steps = round((times[-1] + 2 * SETTLING_S) / STEP_S)
    for step in range(steps):
        time_s = step * STEP_S - SETTLING_S
        wanted = np.array([np.interp(time_s, times, column) for column in positions.T])
        rates = np.array([np.interp(time_s, times, column, left=0.0, right=0.0) for column in velocities.T])
        data.ctrl[actuators] = wanted + ratio * rates
        mujoco.mj_step1(spec, data)
        data.qfrc_applied[:] = 0.0
        data.qfrc_applied[robot_dofs] = data.qfrc_bias[robot_dofs]
        recorded_now_s = np.interp(time_s, grid, recorded_s)
        for correction in corrections:
            correction.apply(recording, recorded_now_s)
        for tip in robot.tips:
            force = recording.at(tip, recorded_now_s)
            if force.any():
                mujoco.mj_jacSite(spec, data, jacobian, None, spec.site(tip).id)
                data.qfrc_applied[fingers] += (jacobian.T @ force)[fingers]
        mujoco.mj_step2(spec, data)
        if viewer is not None:
            viewer.sync()
    return {name: np.concatenate([data.body(name).xpos, data.body(name).xquat]) for name in objects}


def off(end, wanted, upright):
    """The distance of two poses, m, and the angle between them, degrees; `upright`: turns about the vertical do not count."""
    turn, inverse = np.zeros(4), np.zeros(4)
    mujoco.mju_negQuat(inverse, wanted[3:])
    mujoco.mju_mulQuat(turn, end[3:], inverse)
    up = np.zeros(3)
    mujoco.mju_rotVecQuat(up, np.array([0.0, 0.0, 1.0]), turn)
    angle = math.acos(max(-1.0, min(1.0, up[2]))) if upright else 2 * math.acos(min(1.0, abs(turn[0])))
    return float(np.linalg.norm(end[:3] - wanted[:3])), math.degrees(angle)


def compare(args, scene_name, folder):
    """Prints a row for each task of a scene."""
    file = lambda name: str(folder / f"{scene_name}.{name}")
    run = lambda *words: subprocess.run([args.teachtree, *words, "-q"], capture_output=True, text=True)
    if run("teach", scene_name, scene_name, "--seed", str(args.seed), "-o", file("csv")).returncode:
        return print(f"| `{scene_name}` | not demonstrated | | |")
    if run("retarget", file("csv"), "--robot", "both_hands", "-o", file("json")).returncode:
        return print(f"| `{scene_name}` | refused | | |")
    here = run("simulate", file("json"), "--scene", scene_name, "-o", file("robot.csv"), "--trajectory",
               file("trajectory"), "--format", "json")
    if here.returncode not in (0, 4, 5):
        return print(f"| `{scene_name}` | {here.stderr.strip().splitlines()[0]} | | |")
    outcome = json.loads(here.stdout)
    commands = json.loads(Path(file("json")).read_text())
    scene = yaml.safe_load((ROOT / f"scenes/{scene_name}.yaml").read_text())
    trajectory = json.loads(Path(file("trajectory")).read_text())
    ends = replay(scene, ROOT / "robots/both_hands.yaml", trajectory, RobotRecording(Path(file("robot.csv"))), args.view,
                  not args.open_loop)
    for task, result in zip(commands["tasks"], outcome["tasks"]):
        # An object that another hand takes over ends where that hand leaves it.
        last = max((other for other in commands["tasks"] if other["object"] == task["object"]), key=lambda other: other["end_s"])
        wanted = np.array(last["segments"][-1]["object"][-1])
        inserted = any(segment["does"] == "insert" for segment in last["segments"])
        distance, angle = off(ends[task["object"]], wanted, inserted)
        verdict = lambda done: "done" if done else "not done"
        there = verdict(distance <= WITHIN_M and angle <= WITHIN_DEG)
        ours = f"{verdict(result['done'])}, {result['off_m'] * 1e3:.1f} mm, {math.degrees(result['turned_rad']):.1f}°"
        difference = abs(distance - result["off_m"]) * 1e3
        print(f"| `{scene_name}`, {task['object']} | {ours} | {there}, {distance * 1e3:.1f} mm, {angle:.1f}° | {difference:.1f} mm |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenes", nargs="+", help="shipped scenes")
    parser.add_argument("--teachtree", default="teachtree", help="the program")
    parser.add_argument("--seed", type=int, default=1, help="seed of the operator")
    parser.add_argument("--open-loop", action="store_true", help="without the correction of object poses")
    parser.add_argument("--view", action="store_true", help="show the execution in a window")
    args = parser.parse_args()
    print("| scene, object | `simulate` | MuJoCo | difference |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for scene in args.scenes:
            compare(args, scene, Path(folder))


if __name__ == "__main__":
    sys.exit(main())
