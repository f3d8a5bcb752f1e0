"""A fleet by Ray Data (docs/fleet.md)."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import ray.data

from . import fleet

_MOST_BLOCKS = 1000


def run(sources: Iterable[str | os.PathLike[str] | fleet.Recording], job: fleet.Job, out: str, **given: Any) -> fleet.Ran:
    """Does what is not done yet on the cluster that ``ray.init`` joined; what else is ``given`` is that of :func:`teachtree.fleet.plan`."""
    todo = fleet.plan(sources, job, out, **given)
    shards, options = todo.shards, given.get("options")
    if not shards:
        return fleet.Ran(0, 0, todo.skipped)

    def work(row: dict[str, Any]) -> dict[str, int]:
        rows = fleet.run_shard(shards[row["shard"]], job, out, options)
        return {"done": len(rows), "failed": sum(found["status"] != "ok" for found in rows)}

    items = [{"shard": at} for at in range(len(shards))]
    found = ray.data.from_items(items, override_num_blocks=min(len(items), _MOST_BLOCKS)).map(work).take_all()
    return fleet.Ran(sum(row["done"] for row in found), sum(row["failed"] for row in found), todo.skipped)
