#!/usr/bin/env python3
"""Records a LeRobot set with lerobot's own writer: two episodes of a recording of robosuite, with a small picture a frame (docs/datasets.md).

    venv/bin/python tools/record_lerobot_set.py demos/robosuite/nut_assembly_panda_demo_1.csv nuts
"""

import csv, sys
import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset

rows = list(csv.reader(open(sys.argv[1])))
titles, states = rows[0][1:], np.array([[float(cell or "nan") for cell in row[1:]] for row in rows[1:]], np.float32)
features = {
    "observation.state": {"dtype": "float32", "shape": (len(titles),), "names": titles},
    "observation.images.front": {"dtype": "image", "shape": (16, 16, 3), "names": ["height", "width", "channels"]},
    "action": {"dtype": "float32", "shape": (2,), "names": ["a", "b"]},
}
data = LeRobotDataset.create("local/nuts", fps=20, features=features, root=sys.argv[2], use_videos=False)
for part in (states, states[150:]):
    for at, state in enumerate(part):
        data.add_frame({"observation.state": state, "action": state[:2], "task": "put the nut on its peg",
                        "observation.images.front": np.full((16, 16, 3), at % 255, np.uint8)})
    data.save_episode()
data.finalize()
