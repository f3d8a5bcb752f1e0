"""python3 convert.py myosuite OUT

Fingertips by the model of the hand, and the pose of the thing; it is in the air where it is 5 mm above where it began.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from labels import two_labels, write_labels, write_log  # noqa: E402

TIPS = ["THtip", "IFtip", "MFtip", "RFtip", "LFtip"]


def model_of_hand(envs):
    """The hand without the table and the things, which fingertips do not need."""
    text = (envs / "assets/hand/myohand_tabletop.xml").read_text()
    file = envs / "assets/hand/tips.xml"
    file.write_text("\n".join(line for line in text.splitlines() if "simpleTable" not in line))
    return mujoco.MjModel.from_xml_path(str(file))


def main():
    download, out = map(Path, sys.argv[1:])
    envs = download / "myosuite/envs/myo"
    model = model_of_hand(envs)
    data = mujoco.MjData(model)
    header = ["t", *(f"{tip}_{axis}" for tip in TIPS for axis in "xyz")]
    header += [*(f"object_{axis}" for axis in "xyz"), *(f"object_q{axis}" for axis in "wxyz")]
    for file in sorted((envs / "myodm/data").glob("*.npz")):
        recording = np.load(file)
        rows = []
        for time, joints, thing in zip(recording["time"], recording["robot"], recording["object"]):
            data.qpos[:] = joints
            mujoco.mj_kinematics(model, data)
            place = thing[:3] + [0, 0, 0.035]  # of the body of the thing, in assets/hand/myohand_object.xml
            rows.append([time, *np.concatenate([data.site(tip).xpos for tip in TIPS]), *place, *thing[3:]])
        heights = np.array(rows)[:, 18]
        log = out / f"{file.stem.removeprefix('MyoHand_')}.csv"
        write_log(log, header, rows)
        write_labels(log, two_labels(heights > np.median(heights[:5]) + 0.005, "air", "table"))


if __name__ == "__main__":
    main()
