"""python3 convert.py act OUT

The scripted experts of ACT hand a cube from arm to arm, and put a peg into a socket that the other hand holds. The log has the openings and places of both
grippers and the poses of the things; the witness is the contacts of MuJoCo.
"""

import sys
import types
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from labels import two_labels, write_labels, write_log  # noqa: E402

EPISODES = 20
STEP = 0.02  # s
CLOSED, OPEN = 0.01844, 0.058  # place of a finger in `constants.py`, m
FINGERS = ("10_left_gripper_finger", "10_right_gripper_finger")
TASKS = {"transfer_cube": ["box"], "insertion": ["peg", "socket"]}
THINGS = {"red_box", "red_peg", "socket"}


def without_pictures(download):
    """The modules of the download, without what they import for pictures, debugging and training."""
    datasets = types.SimpleNamespace(Dataset=object, TensorDataset=None, DataLoader=None)
    torch = types.SimpleNamespace(utils=types.SimpleNamespace(data=datasets))
    unused = {"IPython": types.SimpleNamespace(embed=None), "h5py": types.ModuleType("h5py"), "torch": torch, "torch.utils": torch.utils}
    sys.modules.update({**unused, "torch.utils.data": datasets, "matplotlib": types.ModuleType("matplotlib")})
    sys.modules["matplotlib.pyplot"] = sys.modules["matplotlib"].pyplot = types.ModuleType("pyplot")
    sys.path.insert(0, str(download))
    import ee_sim_env
    import scripted_policy

    ee_sim_env.mujoco.Physics.render = lambda *_, **__: None
    return ee_sim_env.make_ee_sim_env, {
        "transfer_cube": scripted_policy.PickAndTransferPolicy,
        "insertion": scripted_policy.InsertionPolicy,
    }


def observed(physics, names):
    """A row of the log: of each arm the middle of its fingers and its gripper, 0 closed and 1 open, and the pose of each thing."""
    row = []
    for side in ("left", "right"):
        fingers = [physics.named.data.geom_xpos[f"vx300s_{side}/{finger}"] for finger in FINGERS]
        finger = physics.named.data.qpos[f"vx300s_{side}/left_finger"][0]
        row += [*np.mean(fingers, axis=0), (finger - CLOSED) / (OPEN - CLOSED)]
    for name in names:
        row += [*physics.named.data.xpos[name], *physics.named.data.xquat[name]]
    return row


def held(physics):
    """Whether the left and the right hand hold something: both fingers touch the same thing."""
    touched = {(side, finger): set() for side in ("left", "right") for finger in FINGERS}
    for contact in physics.data.contact:
        names = [physics.model.id2name(geom, "geom") for geom in (contact.geom1, contact.geom2)]
        for one, other in (names, names[::-1]):
            side, _, finger = one.removeprefix("vx300s_").partition("/")
            if (side, finger) in touched:
                touched[side, finger] |= {other.split("-")[0]} & THINGS
    return [bool(set.intersection(*(touched[side, finger] for finger in FINGERS))) for side in ("left", "right")]


def main():
    download, out = map(Path, sys.argv[1:])
    make, experts = without_pictures(download)
    np.random.seed(0)
    for task, things in TASKS.items():
        header = ["t"] + [f"{side}_{what}" for side in ("left", "right") for what in ("x", "y", "z", "gripper")]
        header += [f"{thing}_{what}" for thing in things for what in ("x", "y", "z", "qw", "qx", "qy", "qz")]
        for episode in range(EPISODES):
            env = make(f"sim_{task}_scripted")
            expert, now = experts[task](False), env.reset()
            rows, holds = [], []
            for step in range(400):
                rows.append([step * STEP, *observed(env.physics, things)])
                holds.append(held(env.physics))
                now = env.step(expert(now))
            log = out / task / f"{task}_{episode:02}.csv"
            write_log(log, header, rows)
            labels = []
            for side, flags in zip(("left", "right"), np.array(holds).T):
                labels += [(*row, side) for row in two_labels(flags, "held", "free", shortest=5, bridge=5)]
            write_labels(log, labels, track=True)


if __name__ == "__main__":
    main()
