#!/usr/bin/env python3
"""Checks a copy that `teachtree annotate SET -o COPY` wrote, with the libraries that people train with.

    python3 -m venv venv && venv/bin/pip install datasets==5.2.0
    venv/bin/python tools/check_lerobot.py SET COPY [--lerobot]

- pyarrow and `datasets` load every data file, and every column but those of labels is equal to that of the set, also in its type.
- `subtask_index` (`--legacy`): pandas finds words for every frame as lerobot 0.4.4 does, with `--lerobot` lerobot itself.
- `next.success`: once an episode has succeeded it stays so, and `datasets` gives truths; with `--lerobot` lerobot gives them too.
- Stages of SARM (`--sarm`): frames and times of the lists fit, the end included, and the shares are those of the lists.
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
SUCCESS = "next.success"
NEW = (COLUMN, "subtask_index", "annotation.teachtree.motion", "annotation.teachtree.subtask", SUCCESS)


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
        assert row["timestamp"] in stamps, f"episode {episode}: {row['timestamp']} s is not the stamp of a frame"
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


def check_success(episodes):
    """Checks that no episode loses its success; how many have it."""
    count = 0
    for episode, frames in episodes.items():
        flags = [frame[SUCCESS] for frame in frames]
        assert all(isinstance(flag, bool) for flag in flags), f"episode {episode}: {flags[0]!r} is not a bool"
        assert flags == sorted(flags), f"episode {episode}: succeeds and does so no more"
        count += flags[-1]
    return count


def check_legacy(copy, frames):
    """Looks up the words of frames as lerobot 0.4.4 does; how often they change."""
    import pandas

    subtasks = pandas.read_parquet(copy / "meta/subtasks.parquet")
    assert list(subtasks.subtask_index) == list(range(len(subtasks))), subtasks
    words = [subtasks.iloc[frame["subtask_index"]].name for frame in frames]
    assert all(isinstance(word, str) for word in words), words[0]
    return sum(one != other for one, other in zip(words, words[1:]))


def check_sarm(copy, episodes):
    """Compares the lists of stages with the frames of the episodes; how many stages there are."""
    lists = []
    for file in sorted((copy / "meta/episodes").rglob("*.parquet")):
        lists += pq.read_table(file).to_pylist()
    count = 0
    for prefix in ("sparse", "dense"):
        shares = {}
        for row in lists:
            keys = ("names", "start_times", "end_times", "start_frames", "end_frames")
            names, starts, ends, first, last = (row[f"{prefix}_subtask_{key}"] for key in keys)
            if names is None:
                continue
            stamps = [frame["timestamp"] for frame in episodes[row["episode_index"]]]
            assert names and all(one <= other for one, other in zip(first, last)) and last[-1] < len(stamps)
            assert all(one < other for one, other in zip(last, first[1:]))
            assert starts == [stamps[at] for at in first] and ends == [stamps[at] for at in last]
            lengths = {}
            for name, one, other in zip(names, first, last):
                lengths[name] = lengths.get(name, 0) + other + 1 - one
            for name, length in lengths.items():
                shares.setdefault(name, []).append(length / sum(lengths.values()))
            count += len(names)
        means = {name: sum(parts) / len(parts) for name, parts in shares.items()}
        written = json.loads((copy / f"meta/temporal_proportions_{prefix}.json").read_text())
        assert set(written) == set(means)
        assert all(abs(written[name] - mean / sum(means.values())) < 1e-12 for name, mean in means.items())
    return count


def check_lerobot(copy):
    """Loads the copy with lerobot, and asks its `active_at` about every frame."""
    import lerobot

    try:
        from lerobot.datasets.lerobot_dataset import LeRobotDataset
    except ImportError:
        from lerobot.common.datasets.lerobot_dataset import LeRobotDataset
    data = LeRobotDataset("local/copy", root=copy)
    item = data[0]
    if "subtask" in item:
        words = [data[index]["subtask"] for index in range(len(data))]
        assert all(isinstance(word, str) for word in words)
        print(f"  item['subtask']: {', '.join(sorted(set(words)))}")
    print(f"lerobot {lerobot.__version__}: {data.num_episodes} episodes, {len(data)} frames, {sorted(item)[:6]} …")
    if SUCCESS in item:
        flags = {}
        for index in range(len(data)):
            item = data.hf_dataset[index]
            flags.setdefault(int(item["episode_index"]), []).append(bool(item[SUCCESS]))
        print(f"  {SUCCESS}: true from frame {', '.join(str(of.index(True)) if any(of) else 'none' for of in flags.values())} on")
    if COLUMN not in data.features:
        return
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
    has_language = COLUMN in new["features"]
    is_kept = old["features"].get(SUCCESS) == new["features"].get(SUCCESS)
    mine = [name for name in NEW if name != SUCCESS or not is_kept]
    added = {name: new["features"].pop(name) for name in mine if name in new["features"]}
    assert all(of["shape"] == [1] and of["dtype"] in ("language", "int64", "bool") for of in added.values()), added
    assert new.pop("teachtree")["version"]
    for name in mine:
        old["features"].pop(name, None)
    old.pop("teachtree", None)
    if any(name.startswith("annotation") for name in added):
        old["total_tasks"] = new["total_tasks"]
    assert old == new, "info.json differs"
    files = sorted(path.relative_to(args.set) for path in (args.set / "data").rglob("*.parquet"))
    boundaries = frames = changes = 0
    episodes = {}
    for file in files:
        one, other = (pq.read_table(folder / file) for folder in (args.set, args.copy))
        kept = [name for name in one.column_names if name not in mine]
        assert [name for name in other.column_names if name not in mine] == kept
        for name in kept:
            assert one.schema.field(name).equals(other.schema.field(name)), (one.schema, other.schema)
            assert one[name].to_pylist() == other[name].to_pylist(), f"{file}: {name} differs"
        data = Dataset.from_parquet(str(args.copy / file))
        assert set(added) <= set(data.features), data.features
        frames += len(data)
        all_frames = other.select([name for name in other.column_names if not name.startswith("observation")]).to_pylist()
        for frame in all_frames:
            episodes.setdefault(frame["episode_index"], []).append(frame)
        if "subtask_index" in added:
            changes += check_legacy(args.copy, all_frames)
        if has_language:
            assert [row[COLUMN] for row in data] == other[COLUMN].to_pylist()
    if has_language:
        boundaries = sum(check_episode(episode, own) for episode, own in episodes.items())
    if SUCCESS in added:
        print(f"{SUCCESS}: {check_success(episodes)} of {len(episodes)} episodes succeed")
    if "subtask_index" in added:
        print(f"subtask_index: words for {frames} frames, {changes} changes")
    if (args.copy / "meta/temporal_proportions_sparse.json").exists():
        print(f"SARM: {check_sarm(args.copy, episodes)} stages")
    print(f"{args.copy}: {len(files)} files, {frames} frames, {boundaries} boundaries, all as expected")
    if args.lerobot:
        check_lerobot(args.copy)


if __name__ == "__main__":
    sys.exit(main())
