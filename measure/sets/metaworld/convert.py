"""python3 convert.py - OUT

Meta-World has no recordings, but an expert for each task: three recordings of each task in which something loose is grasped. The log has the pads of the
gripper and the pose of the thing; the witness is the contacts of MuJoCo. Nothing is downloaded but the package.
"""

import sys
import warnings
from pathlib import Path

import gymnasium
import metaworld  # noqa: F401, registers the environments
import mujoco
import numpy as np
from metaworld.policies import ENV_POLICY_MAP

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from labels import two_labels, write_labels, write_log  # noqa: E402

TASKS = (
    "assembly basketball bin-picking box-close disassemble hammer peg-insert-side pick-out-of-hole pick-place pick-place-wall shelf-place stick-pull"
).split()
SEEDS = 3
LONGEST = 500  # steps
AFTER = 20  # steps behind the first success


def subtree(model, body):
    """A body and all bodies that hang on it."""
    inside = {body}
    for other in range(body + 1, model.nbody):
        if model.body_parentid[other] in inside:
            inside.add(other)
    return inside


def touching(data, model, ones, others):
    """Whether a geometry of `ones` touches one of `others`, sets of bodies."""
    for contact in data.contact[: data.ncon]:
        pair = {model.geom_bodyid[contact.geom1], model.geom_bodyid[contact.geom2]}
        if len(pair) == 2 and pair & ones and (pair - ones) & others:
            return True
    return False


def record(task, seed):
    """The rows of a recording and whether the thing is carried in each: both pads touch it, and nothing else does."""
    env = gymnasium.make("Meta-World/MT1", env_name=f"{task}-v3", seed=seed, disable_env_checker=True)
    expert = ENV_POLICY_MAP[f"{task}-v3"]()
    observation, _ = env.reset(seed=seed)
    simulation = env.unwrapped
    model, data = simulation.model, simulation.data
    name = lambda body: mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or ""  # noqa: E731
    by_name = {name(body): body for body in range(model.nbody)}
    free = [model.jnt_bodyid[joint] for joint in range(model.njnt) if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE]
    thing = free[0]
    body = subtree(model, thing)
    left, right = subtree(model, by_name["leftclaw"]), subtree(model, by_name["rightclaw"])
    hand = subtree(model, by_name["hand"])
    others = set(range(model.nbody)) - body - hand
    rows, carried, until = [], [], LONGEST
    for step in range(LONGEST):
        pads = [data.body(pad).xpos.copy() for pad in ("leftpad", "rightpad")]
        rows.append([step * simulation.dt, *pads[0], *pads[1], *data.xpos[thing], *data.xquat[thing]])
        held = touching(data, model, body, left) and touching(data, model, body, right)
        carried.append(held and not touching(data, model, body, others))
        observation, _, _, truncated, info = env.step(expert.get_action(observation))
        if info["success"] and until == LONGEST:
            until = step + AFTER
        if truncated or step >= until:
            break
    env.close()
    return rows, np.array(carried), simulation.dt


def main():
    warnings.filterwarnings("ignore")
    out = Path(sys.argv[2])
    header = ["t", *(f"{what}_{axis}" for what in ("left_pad", "right_pad", "thing") for axis in "xyz"), *(f"thing_q{axis}" for axis in "wxyz")]
    for task in TASKS:
        for seed in range(SEEDS):
            rows, carried, step = record(task, seed)
            log = out / f"{task}_{seed}.csv"
            write_log(log, header, rows)
            write_labels(log, two_labels(carried, "air", "rest", shortest=round(0.1 / step), bridge=round(0.1 / step)))


if __name__ == "__main__":
    main()
