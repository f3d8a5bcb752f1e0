"""A fleet by Dask (docs/fleet.md)."""

from __future__ import annotations

import os
import time
from asyncio import CancelledError
from collections.abc import Iterable, Iterator
from typing import Any

from distributed import Client, Future, KilledWorker, as_completed
from distributed.client import FutureCancelledError

from . import fleet
from .fleet._run import Rows, counted, failed


def run(
    sources: Iterable[str | os.PathLike[str] | fleet.Recording], job: fleet.Job, out: str, *, client: Client, patience: float = 300.0, **given: Any
) -> fleet.Ran:
    """Does what is not done yet on the workers of ``client``; what else is ``given`` is that of :func:`teachtree.fleet.plan`.

    If a worker ends, nothing is lost: Dask gives its shards to others. A shard that ends every worker that it runs on, as one that needs more memory than
    they have, is divided. A recording that does it alone, when nothing else of this run is on the cluster, is a row of ``manifest`` with the code
    ``killed``. A cluster that loses its last worker and has none for ``patience`` seconds ends the run with a ``RuntimeError``; what was written stays,
    and the same call goes on from there.
    """
    todo = fleet.plan(sources, job, out, **given)
    options = given.get("options")

    def submit(shard: fleet.Shard) -> Future:
        return client.submit(fleet.run_shard, shard, job, out, options, pure=False)

    def rows() -> Iterator[Rows]:
        of = {submit(shard): shard for shard in todo.shards}
        waiting = as_completed(list(of))
        # Dask holds the end of a worker against each shard that waited there, so a recording is blamed only after it ran with no other.
        suspects: list[fleet.Shard] = []
        alone: Future | None = None
        for future in _completed(waiting, client, patience):
            shard = of.pop(future)
            parts: list[fleet.Shard] = []
            try:
                found: Rows = future.result()
            except KilledWorker:
                found = []
                if len(shard.recordings) > 1:
                    parts = [fleet.Shard.of(job, [recording]) for recording in shard.recordings]
                elif future is alone:
                    found = failed(shard, job, out, f"{shard.recordings[0].path}: ended every worker that read it", options)
                else:
                    suspects.append(shard)
            except (CancelledError, FutureCancelledError):
                # Its worker ended before the rows were fetched; what is committed is only read again.
                found, parts = [], [shard]
            for part in parts:
                again = submit(part)
                of[again] = part
                waiting.add(again)
            if suspects and not of:
                shard = suspects.pop()
                alone = submit(shard)
                of[alone] = shard
                waiting.add(alone)
            yield found

    return counted(rows(), len(todo), todo.skipped)


def _completed(waiting: as_completed, client: Client, patience: float) -> Iterator[Future]:
    """Yields the futures as they complete, while the cluster has workers or has not had any yet."""
    had_workers, last_seen, next_look = False, 0.0, 0.0
    while not waiting.is_empty():
        if waiting.has_ready():
            yield next(waiting)
            continue
        time.sleep(0.05)
        now = time.monotonic()
        if now < next_look:
            continue
        next_look = now + 5.0
        if client.nthreads():
            had_workers, last_seen = True, now
        elif had_workers and now > last_seen + patience:
            raise RuntimeError(
                f"the cluster has had no worker for {now - last_seen:.0f} s: its workers ended and were not started again. "
                "Start workers and call this again; recordings that are done are skipped"
            )
