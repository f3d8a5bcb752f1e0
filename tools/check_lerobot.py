#!/usr/bin/env python3
"""Checks a copy that `teachtree annotate SET -o COPY` wrote, with the libraries that people train with.

    python3 -m venv venv && venv/bin/pip install datasets==5.2.0
    venv/bin/python tools/check_lerobot.py SET COPY [--lerobot]

- pyarrow and `datasets` load every data file, and every column but `language_persistent` is equal to that of the set.
- On all frames of an episode the rows of language are equal; stamps are those of frames, and no two rows of a style have one stamp.
- The words at each boundary, and one frame before and after it, are those of the row that `active_at` of lerobot finds: the last one that is
  not later than the frame. With `--lerobot` lerobot itself loads the copy, and its own `active_at` is asked where this version of it has one.
"""

import argparse
import json
import sys
from pathlib import Path

import pyarrow.parquet as pq
from datasets import Dataset

COLUMN = "language_persistent"


def active_at(rows, time, style):
    """The rows that hold at a time, as lerobot's documentation defines it."""
    before = [row for row in rows if row["style"] == style and row["timestamp"] <= time]
    latest = max((row["timestamp"] for row in before), default=None)
    return [row for row in before if row["timestamp"] == latest]


def check_episode(episode, frames):
    """Checks the language of an episode; how many boundaries it has."""
    stamps = [frame["timestamp"] for frame in frames]
    rows = frames[0][COLUMN]
    for frame in frames:
        assert frame[COLUMN] == rows, f"episode {episode}: frames have different language"
    for row in rows:
        assert row["timestamp"] in stamps, f"episode {episode}: {row['timestamp']} s is no stamp of a frame"
        assert row["camera"] is None and row["tool_calls"] is None and row["role"] and row["content"]
    boundaries = 0
    for style in {row["style"] for row in rows}:
        own = [row for row in rows if row["style"] == style]
        assert own == sorted(own, key=lambda row: row["timestamp"])
        for at, row in enumerate(own):
            boundaries += 1
            frame = stamps.index(row["timestamp"])
            for near, wanted in ((frame - 1, at - 1), (frame, at), (frame + 1, at)):
                if not 0 <= near < len(stamps) or wanted < 0:
                    continue
                if wanted == at and at + 1 < len(own) and stamps[near] >= own[at + 1]["timestamp"]:
                    wanted += 1
                found = active_at(rows, stamps[near], style)
                assert found == [own[wanted]], f"episode {episode}, frame {near}: {found}, expected {own[wanted]}"
    return boundaries


def check_lerobot(copy):
    """Loads the copy with lerobot, and asks its `active_at` about every frame."""
    import lerobot

    try:
        from lerobot.datasets.lerobot_dataset import LeRobotDataset
    except ImportError:
        from lerobot.common.datasets.lerobot_dataset import LeRobotDataset
    data = LeRobotDataset("local/copy", root=copy)
    item = data[0]
    print(f"lerobot {lerobot.__version__}: {data.num_episodes} episodes, {len(data)} frames, {sorted(item)[:6]} …")
    try:
        from lerobot.datasets.language_render import active_at as theirs
    except ImportError:
        print("  this version has no language columns: what it reads of the copy is what it reads of the set")
        return
    asked = 0
    for index in range(len(data)):
        item = data.hf_dataset[index]
        rows, time = item[COLUMN], float(item["timestamp"])
        for style in {row["style"] for row in rows}:
            found = theirs(time, persistent=rows, style=style)
            assert ([found] if found else []) == active_at(rows, time, style), (index, style, found)
            asked += 1
    print(f"  active_at: {asked} answers as expected")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("copy", type=Path)
    parser.add_argument("--lerobot", action="store_true", help="load the copy with lerobot too")
    args = parser.parse_args()
    old, new = (json.loads((folder / "meta/info.json").read_text()) for folder in (args.set, args.copy))
    assert new["features"].pop(COLUMN) == {"dtype": "language", "shape": [1], "names": None}
    assert new.pop("teachtree")["version"]
    old["features"].pop(COLUMN, None)
    old.pop("teachtree", None)
    assert old == new, "info.json differs"
    files = sorted(path.relative_to(args.set) for path in (args.set / "data").rglob("*.parquet"))
    boundaries = frames = 0
    for file in files:
        one, other = (pq.read_table(folder / file) for folder in (args.set, args.copy))
        kept = [name for name in one.column_names if name != COLUMN]
        assert [name for name in other.column_names if name != COLUMN] == kept
        for name in kept:
            assert one[name].to_pylist() == other[name].to_pylist(), f"{file}: {name} differs"
        data = Dataset.from_parquet(str(args.copy / file))
        assert COLUMN in data.features, data.features
        frames += len(data)
        assert [row[COLUMN] for row in data] == other[COLUMN].to_pylist()
        episodes = {}
        for frame in other.select(["episode_index", "timestamp", COLUMN]).to_pylist():
            episodes.setdefault(frame["episode_index"], []).append(frame)
        for episode, own in episodes.items():
            boundaries += check_episode(episode, own)
    print(f"{args.copy}: {len(files)} files, {frames} frames, {boundaries} boundaries, all as expected")
    if args.lerobot:
        check_lerobot(args.copy)


if __name__ == "__main__":
    sys.exit(main())
