#!/usr/bin/env python3
"""Makes LeRobot sets in tests/fixtures/formats: v3.0 `lerobot_v30`, one hand and three episodes, `lerobot_v30_hands`, two hands and one; and v2.1
`lerobot_v21_nuts`, one hand and two episodes.

    python3 -m venv venv && venv/bin/pip install datasets==5.2.0
    venv/bin/python tools/make_lerobot_fixtures.py

The recordings are those of robosuite in `demos/robosuite` (MIT): a row a frame, all columns in `observation.state`. The files are written as
`datasets` and lerobot write them: with the metadata of Arrow, of `datasets` and of pandas; two episodes in one row group, one in a file of its own.
"""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from datasets import Dataset, Features, List, Value

ROOT = Path(__file__).resolve().parent.parent
DEMOS = ROOT / "demos/robosuite"
FIXTURES = ROOT / "tests/fixtures/formats"
FPS = 20


def recording(name):
    """Titles and rows of a recording, without its stamps."""
    with open(DEMOS / name, newline="") as file:
        head, *rows = csv.reader(file)
    return head[1:], np.array([[float(cell or "nan") for cell in row[1:]] for row in rows], np.float32)


def frames(episode, states, first):
    count = len(states)
    return {
        "observation.state": [row for row in states],
        "timestamp": (np.arange(count) / FPS).astype(np.float32),
        "frame_index": np.arange(count),
        "episode_index": np.full(count, episode),
        "index": np.arange(first, first + count),
        "task_index": np.zeros(count, np.int64),
    }


def make(name, task, titles, episodes, files):
    """Writes a set; `files` has the numbers of the episodes in each data file."""
    folder = FIXTURES / name
    shutil.rmtree(folder, ignore_errors=True)
    width = len(titles)
    int64, float32 = Value("int64"), Value("float32")
    features = Features({
        "observation.state": List(float32, length=width), "timestamp": float32, "frame_index": int64,
        "episode_index": int64, "index": int64, "task_index": int64,
    })
    listed, first = [], 0
    for file, numbers in enumerate(files):
        parts = []
        for number in numbers:
            parts.append(frames(number, episodes[number], first))
            listed.append({
                "episode_index": number, "tasks": [task], "length": len(episodes[number]),
                "data/chunk_index": 0, "data/file_index": file,
                "dataset_from_index": first, "dataset_to_index": first + len(episodes[number]),
                "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
            })
            first += len(episodes[number])
        table = {key: np.concatenate([np.asarray(part[key]) for part in parts]) for key in parts[0]}
        table["observation.state"] = list(table["observation.state"])
        path = folder / f"data/chunk-000/file-{file:03d}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        Dataset.from_dict(table, features=features).to_parquet(str(path))
    path = folder / "meta/episodes/chunk-000/file-000.parquet"
    path.parent.mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(listed), path)
    pd.DataFrame({"task_index": [0]}, index=[task]).to_parquet(folder / "meta/tasks.parquet")
    plain = {"dtype": "int64", "shape": [1], "names": None}
    info = {
        "codebase_version": "v3.0", "robot_type": "panda", "total_episodes": len(episodes), "total_frames": first,
        "total_tasks": 1, "chunks_size": 1000, "data_files_size_in_mb": 100, "video_files_size_in_mb": 200, "fps": FPS,
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": None,
        "features": {
            "observation.state": {"dtype": "float32", "shape": [width], "names": titles},
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            "frame_index": plain, "episode_index": plain, "index": plain, "task_index": plain,
        },
    }
    (folder / "meta/info.json").write_text(json.dumps(info, indent=4))
    states = np.concatenate(episodes)
    stats = {"min": states.min(0), "max": states.max(0), "mean": states.mean(0), "std": states.std(0)}
    stats = {key: [round(float(value), 6) for value in values] for key, values in stats.items()}
    (folder / "meta/stats.json").write_text(json.dumps({"observation.state": {**stats, "count": [len(states)]}}))
    shutil.copy(DEMOS / "LICENSE", folder / "LICENSE")


def make_v21(name, task, titles, episodes):
    """Writes a set of version 2.1: a file an episode, lists as JSON lines, and the modalities of GR00T."""
    folder = FIXTURES / name
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "data/chunk-000").mkdir(parents=True)
    (folder / "meta").mkdir()
    width = len(titles)
    int64, float32 = Value("int64"), Value("float32")
    features = Features({
        "observation.state": List(float32, length=width), "timestamp": float32, "frame_index": int64,
        "episode_index": int64, "index": int64, "task_index": int64,
    })
    lines, first = [], 0
    for number, states in enumerate(episodes):
        path = folder / f"data/chunk-000/episode_{number:06d}.parquet"
        Dataset.from_dict(frames(number, states, first), features=features).to_parquet(str(path))
        lines.append({"episode_index": number, "tasks": [task], "length": len(states)})
        first += len(states)
    (folder / "meta/episodes.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    (folder / "meta/tasks.jsonl").write_text(json.dumps({"task_index": 0, "task": task}) + "\n")
    modality = {
        "state": {"arm": {"start": 0, "end": width}}, "action": {"arm": {"start": 0, "end": width}},
        "annotation": {"human.task_description": {"original_key": "task_index"}},
    }
    (folder / "meta/modality.json").write_text(json.dumps(modality, indent=4))
    plain = {"dtype": "int64", "shape": [1], "names": None}
    info = {
        "codebase_version": "v2.1", "robot_type": "panda", "total_episodes": len(episodes), "total_frames": first,
        "total_tasks": 1, "total_videos": 0, "total_chunks": 1, "chunks_size": 1000, "fps": FPS,
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet", "video_path": None,
        "features": {
            "observation.state": {"dtype": "float32", "shape": [width], "names": titles},
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            "frame_index": plain, "episode_index": plain, "index": plain, "task_index": plain,
        },
    }
    (folder / "meta/info.json").write_text(json.dumps(info, indent=4))
    shutil.copy(DEMOS / "LICENSE", folder / "LICENSE")


def binding(name, source):
    """The binding of a demo, with the columns of the set."""
    text = (DEMOS / source).read_text().replace("time: t [s]\n\n", "")
    lines, inside = [], False
    for line in text.splitlines():
        inside = line == "channels:" or inside and line.startswith("  ")
        if inside and line.startswith("  "):
            key, column = line.split(": ", 1)
            minus = "-" if column.startswith("-") else ""
            line = f"{key}: {minus}observation.state.{column[len(minus):]}"
        lines.append(line)
    (FIXTURES / f"{name}.binding.yaml").write_text("\n".join(lines) + "\n")


def main():
    titles, states = recording("nut_assembly_panda_demo_1.csv")
    make("lerobot_v30", "put the nuts on the pegs", titles, [states, states[:100], states[150:]], [[0, 1], [2]])
    binding("lerobot_v30", "panda_nut_assembly.binding.yaml")
    make_v21("lerobot_v21_nuts", "put the nuts on the pegs", titles, [states[:100], states[150:]])
    titles, states = recording("handover_panda_panda_demo_5.csv")
    make("lerobot_v30_hands", "hand the hammer over", titles, [states], [[0]])
    binding("lerobot_v30_hands", "handover.binding.yaml")


if __name__ == "__main__":
    main()
