"""Runs a shard: the function that engines call."""

from __future__ import annotations

import hashlib
import os
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import pyarrow

from .._errors import Error
from .._log import Log
from .._table import Table
from ._job import Job
from ._plan import SHARD_SIZE, Recording, Shard, plan
from ._results import SCHEMAS, TABLES, store_of
from ._sources import Sources
from ._store import Store, as_parquet

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class Ran:
    """What a run did."""

    done: int
    """Recordings whose results were added, those that cannot be used among them."""
    failed: int
    """Of them, recordings that cannot be used: each is a row of ``manifest`` with its error."""
    skipped: int
    """Recordings that were done before."""


def run_shard(shard: Shard, job: Job, out: str, options: Mapping[str, Any] | None = None) -> Rows:
    """Analyzes the recordings of a shard and adds their rows to the results; returns the rows of ``manifest``.

    A shard that is done returns its rows again and does nothing else. A recording that cannot be used is a row with ``status`` ``"error"``,
    ``code`` and ``error``; an object store that does not answer is tried three times.
    """
    return _shard(shard, job, out, options, threading.Event())


class _Stopped(Exception):
    """The run has ended; nothing of the shard is committed."""


def _shard(shard: Shard, job: Job, out: str, options: Mapping[str, Any] | None, stop: threading.Event) -> Rows:
    store = store_of(out, job, options)
    name = f"{shard.name}.parquet"
    known = _known(store, name)
    if known is not None:
        return known
    parts: dict[str, list[pyarrow.Table]] = {table: [] for table in TABLES}
    manifest: Rows = []
    with Sources(options) as sources:
        for recording in shard.recordings:
            if stop.is_set():
                raise _Stopped
            row, tables = _one(recording, job, sources)
            manifest.append({**row, "shard": shard.name})
            for table, part in tables.items():
                parts[table].append(part)
    _commit(store, name, job, parts, manifest)
    return manifest


def failed(shard: Shard, job: Job, out: str, error: str, options: Mapping[str, Any] | None = None) -> Rows:
    """Adds the rows of a shard that ends every worker that it runs on; one that was committed before its worker ended stays."""
    store = store_of(out, job, options)
    known = _known(store, f"{shard.name}.parquet")
    if known is not None:
        return known
    manifest = [{**_blank(recording, job), "code": "killed", "error": error, "shard": shard.name} for recording in shard.recordings]
    _commit(store, f"{shard.name}.parquet", job, {table: [] for table in TABLES}, manifest)
    return manifest


def _known(store: Store, name: str) -> Rows | None:
    """The rows of ``manifest`` of a shard that is done."""
    return store.read_table(f"manifest/{name}").to_pylist() if store.exists(f"manifest/{name}") else None


def _commit(store: Store, name: str, job: Job, parts: Mapping[str, list[pyarrow.Table]], manifest: Rows) -> None:
    if not store.exists("job.json"):
        store.write("job.json", job.describe().encode())
    files = {}
    for table, tables in parts.items():
        content = as_parquet(pyarrow.concat_tables(tables) if tables else SCHEMAS[table].empty_table())
        # By its content: of two attempts at a shard with unlike results, each has its own, and the manifest says whose is valid.
        files[table] = f"{_shard_of(name)}-{hashlib.sha256(content).hexdigest()[:32]}.parquet"
        store.write(f"{table}/{files[table]}", content)
    # Last: with it, the shard is done.
    done_at = datetime.now(UTC)
    rows = [{**row, "done_at": done_at} for row in manifest]
    schema = SCHEMAS["manifest"].with_metadata(files)
    store.write(f"manifest/{name}", as_parquet(pyarrow.Table.from_pylist(rows, schema)))


def _shard_of(name: str) -> str:
    """The name of a shard by that of its file."""
    return name.removesuffix(".parquet")


def _blank(recording: Recording, job: Job) -> dict[str, Any]:
    row = dict.fromkeys(SCHEMAS["manifest"].names)
    return {**row, "log": _text(recording.path), "key": recording.key(job), "status": "error", "seconds": 0.0}


def _text(text: str) -> str:
    """A text without the bytes of file names that are not UTF-8, which Parquet cannot hold."""
    return text.encode(errors="backslashreplace").decode()


def _one(recording: Recording, job: Job, sources: Sources) -> tuple[dict[str, Any], dict[str, pyarrow.Table]]:
    row = _blank(recording, job)
    begun = time.perf_counter()
    try:
        local = _again(lambda: sources.local(recording.path))
        _, binding, scene = job.ready()
        analysis = job.analyze(Log(local, binding=binding, scene=scene, project=False))
        tables = {"segments": analysis.segments, "tasks": analysis.tasks, "issues": analysis.issues}
        parts = {table: _rows(made, SCHEMAS[table], row["log"], row["key"]) for table, made in tables.items()}
    except Error as error:
        text = job.named(error.rendered.replace(local, row["log"]))
        if row["log"] not in text:
            text = f"{row['log']}: {text}"
        return {**row, "code": error.code, "error": text, "seconds": time.perf_counter() - begun}, {}
    except OSError as error:
        text = _text(f"{recording.path}: {error}")
        return {**row, "code": "io", "error": text, "seconds": time.perf_counter() - begun}, {}
    counts = {table: len(part) for table, part in parts.items()}
    facts = {"frames": analysis.frame_count, "duration_s": analysis.end_s - analysis.start_s, "rules": analysis.digest}
    return {**row, **counts, **facts, "status": "ok", "seconds": time.perf_counter() - begun}, parts


def _rows(table: Table, schema: pyarrow.Schema, log: str, key: str) -> pyarrow.Table:
    found = pyarrow.table(table)
    columns = [pyarrow.repeat(log, len(found)), pyarrow.repeat(key, len(found)), *found.columns]
    return pyarrow.table(columns, schema=schema)


def _again(fetch: Callable[[], str]) -> str:
    for wait in (1.0, 4.0):
        try:
            return fetch()
        except FileNotFoundError:
            raise
        except OSError:
            time.sleep(wait)
    return fetch()


def run(
    sources: Iterable[str | os.PathLike[str] | Recording],
    job: Job,
    out: str,
    *,
    jobs: int = 1,
    shard_size: int = SHARD_SIZE,
    shard: tuple[int, int] | None = None,
    options: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Ran:
    """Does all in this process, on ``jobs`` threads; ``shard`` as in :func:`plan`. ``progress`` is called with how many recordings of how many are done."""
    todo = plan(sources, job, out, shard_size=shard_size, shard=shard, options=options)

    stop = threading.Event()

    def work(part: Shard) -> Rows:
        return _shard(part, job, out, options, stop)

    pool = ThreadPoolExecutor(max(1, jobs), thread_name_prefix="teachtree")
    try:
        return counted(pool.map(work, todo.shards), len(todo), todo.skipped, progress)
    finally:
        # After Ctrl-C a thread ends with the recording that it is at.
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)


def counted(results: Iterable[Rows], of: int, skipped: int, progress: Callable[[int, int], None] | None = None) -> Ran:
    """Counts the rows of shards as they come."""
    done = wrong = 0
    for rows in results:
        done += len(rows)
        wrong += sum(row["status"] != "ok" for row in rows)
        if progress is not None:
            progress(done, of)
    return Ran(done, wrong, skipped)
