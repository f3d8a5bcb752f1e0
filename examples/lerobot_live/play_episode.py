#!/usr/bin/env python3
"""Plays an episode of a LeRobot set as LeRobot shows an arm that moves: with its own Foxglove server, on ws://127.0.0.1:8765.

    pip install 'lerobot[viz]' pyarrow
    python3 play_episode.py ../so101_joints/pick_block 0
    python3 play_episode.py ../so101_joints/pick_block 0 --mcap episode.mcap

With `--mcap`, the messages are written into a file instead, without LeRobot (`pip install foxglove-sdk pyarrow`).
"""

import argparse
import json
import time
from pathlib import Path

import pyarrow.parquet as pq


def observations(folder, episode):
    """The observations of an episode: names and numbers, as a robot returns them."""
    names = json.loads((folder / "meta/info.json").read_text())["features"]["observation.state"]["names"]
    for file in sorted(folder.glob("data/*/*.parquet")):
        for row in pq.read_table(file).to_pylist():
            if row["episode_index"] == episode:
                yield row["timestamp"], dict(zip(names, row["observation.state"]))


def serve(rows):
    from lerobot.utils.foxglove_visualization import init_foxglove, log_foxglove_data, shutdown_foxglove

    init_foxglove()
    input("The server runs. Start `teachtree live`, then press ENTER.")
    begin = time.monotonic()
    for stamp, observation in rows:
        time.sleep(max(0.0, begin + stamp - time.monotonic()))
        log_foxglove_data(observation=observation)
    time.sleep(1.0)
    shutdown_foxglove()


def record(rows, path):
    """Writes the messages of `log_foxglove_data`: a list of labels and values, in JSON, without a stamp of their own."""
    import foxglove

    part = {"type": "object", "properties": {"label": {"type": "string"}, "value": {"type": "number"}}}
    schema = {"type": "object", "title": "lerobot.Scalars", "properties": {"scalars": {"type": "array", "items": part}}}
    with foxglove.open_mcap(path, allow_overwrite=True):
        channel = foxglove.Channel("/observation/state", schema=schema, message_encoding="json")
        for stamp, observation in rows:
            scalars = [{"label": label, "value": value} for label, value in observation.items()]
            channel.log({"scalars": scalars}, log_time=1_772_446_500_000_000_000 + round(stamp * 1e9))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("set", type=Path)
    parser.add_argument("episode", type=int)
    parser.add_argument("--mcap")
    asked = parser.parse_args()
    rows = observations(asked.set, asked.episode)
    record(rows, asked.mcap) if asked.mcap else serve(rows)
