"""The results of jobs: what is done, and all rows once."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pyarrow
import pyarrow.compute

from .._log import _argument
from ._job import Job
from ._store import Store

TABLES = ("segments", "tasks", "issues")

_SPAN = [
    ("start_s", pyarrow.float64()),
    ("end_s", pyarrow.float64()),
    ("start_row", pyarrow.int64()),
    ("end_row", pyarrow.int64()),
    ("start_frame", pyarrow.int64()),
    ("end_frame", pyarrow.int64()),
]
_TEXT = pyarrow.string()
_OF = [("log", _TEXT), ("key", _TEXT)]
SCHEMAS = {
    "segments": pyarrow.schema(
        [*_OF, ("track", _TEXT), ("primitive", _TEXT), ("object", _TEXT), ("partner", _TEXT), *_SPAN]
        + [("task", pyarrow.int64()), ("was", pyarrow.list_(_TEXT)), ("by", pyarrow.list_(_TEXT))]
    ),
    "tasks": pyarrow.schema(
        [*_OF, ("track", _TEXT), ("task", _TEXT), ("object", _TEXT), ("partner", _TEXT), *_SPAN]
        + [("attempt", pyarrow.int64()), ("failure", pyarrow.bool_())]
        + [("secondary", pyarrow.list_(_TEXT)), ("cut_at_start", pyarrow.bool_()), ("cut_at_end", pyarrow.bool_())]
    ),
    "issues": pyarrow.schema(
        [*_OF, ("kind", _TEXT), ("start_s", pyarrow.float64()), ("end_s", pyarrow.float64()), ("channel", _TEXT), ("message", _TEXT)]
    ),
    "manifest": pyarrow.schema(
        [*_OF, ("status", _TEXT), ("code", _TEXT), ("error", _TEXT), ("frames", pyarrow.int64()), ("duration_s", pyarrow.float64())]
        + [("segments", pyarrow.int64()), ("tasks", pyarrow.int64()), ("issues", pyarrow.int64())]
        + [("rules", _TEXT), ("seconds", pyarrow.float64()), ("shard", _TEXT), ("done_at", pyarrow.timestamp("us", "UTC"))]
    ),
}


def store_of(out: str, job: Job | str, options: Mapping[str, Any] | None = None) -> Store:
    """The folder of a job's results."""
    return Store(f"{str(out).rstrip('/')}/job={job if isinstance(job, str) else job.digest}", options)


def done_keys(out: str, job: Job, options: Mapping[str, Any] | None = None) -> set[str]:
    """The keys of the recordings that are done."""
    store = store_of(out, job, options)
    keys: set[str] = set()
    for name in store.names("manifest", ".parquet"):
        keys.update(store.read_table(f"manifest/{name}", ["key"])["key"].to_pylist())
    return keys


def jobs(out: str, options: Mapping[str, Any] | None = None) -> list[dict[str, Any]]:
    """The jobs whose results are in a folder: digest, rules, params, binding, version."""
    store = Store(str(out), options)
    try:
        folders = sorted(store.fs.ls(store.root, detail=False))
    except FileNotFoundError:
        return []
    names = [folder.rstrip("/").rpartition("/")[2] for folder in folders]
    described = (f"{name}/job.json" for name in names if name.startswith("job="))
    return [json.loads(store.read(name)) for name in described if store.exists(name)]


def read(out: str, job: Job | str, table: str = "segments", *, options: Mapping[str, Any] | None = None) -> pyarrow.Table:
    """All rows of a table: ``"segments"``, ``"tasks"``, ``"issues"``, or ``"manifest"`` with a row for each recording; ordered by log.

    Of a recording that was done more than once, since it changed or by two plans at once, the rows that were made last are there. What a killed
    worker left is not read.
    """
    if table not in SCHEMAS:
        raise ValueError(f"expected one of {', '.join(SCHEMAS)}, found `{table}`")
    store = store_of(out, job, options)
    last: dict[str, tuple[int, str, str]] = {}
    counts: dict[str, int] = {}
    files: dict[str, str] = {}
    for name in store.names("manifest", ".parquet"):
        found = store.read_table(f"manifest/{name}", ["log", "key", "done_at"])
        counts[name] = len(found)
        files[name] = name if table == "manifest" else found.schema.metadata[table.encode()].decode()
        times = found["done_at"].cast(pyarrow.int64()).to_pylist()
        for log, key, done_at in zip(found["log"].to_pylist(), found["key"].to_pylist(), times):
            last[log] = max(last.get(log, (0, "", "")), (done_at, name, key))
    kept: dict[str, list[str]] = {name: [] for name in counts}
    for _, name, key in last.values():
        kept[name].append(key)
    parts: list[pyarrow.Table] = []
    for name, keys in kept.items():
        part = store.read_table(f"{table}/{files[name]}")
        if len(keys) < counts[name]:
            part = part.filter(pyarrow.compute.is_in(part["key"], value_set=pyarrow.array(keys, pyarrow.string())))
        parts.append(part)
    if not parts:
        return SCHEMAS[table].empty_table()
    order = [(name, "ascending") for name in ("log", "track", "start_s", "end_s", "kind") if name in SCHEMAS[table].names]
    return pyarrow.concat_tables(parts).combine_chunks().sort_by(order)


def read_manifest(out: str, job: Job | str, options: Mapping[str, Any] | None = None) -> pyarrow.Table:
    """The manifest of a job that has one."""
    found = read(out, job, "manifest", options=options)
    if not len(found):
        digest = job if isinstance(job, str) else job.digest
        help = "`python -m teachtree.fleet jobs` lists the jobs of a folder; other rules, params or files make another job"
        raise _argument(str(out), f"there are no results of the job `{digest}`", help)
    return found
