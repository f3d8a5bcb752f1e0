"""The results of jobs: what is done, and all rows once."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pyarrow
import pyarrow.compute

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
        + [("secondary", pyarrow.list_(_TEXT)), ("cut_at_start", pyarrow.bool_()), ("cut_at_end", pyarrow.bool_())]
    ),
    "issues": pyarrow.schema(
        [*_OF, ("kind", _TEXT), ("start_s", pyarrow.float64()), ("end_s", pyarrow.float64()), ("channel", _TEXT), ("message", _TEXT)]
    ),
    "manifest": pyarrow.schema(
        [*_OF, ("status", _TEXT), ("code", _TEXT), ("error", _TEXT), ("frames", pyarrow.int64()), ("duration_s", pyarrow.float64())]
        + [("segments", pyarrow.int64()), ("tasks", pyarrow.int64()), ("issues", pyarrow.int64())]
        + [("rules", _TEXT), ("seconds", pyarrow.float64()), ("shard", _TEXT)]
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

    Of a recording that was done in two shards, by two plans at once, the rows are there once. What a killed worker left is not read.
    """
    if table not in SCHEMAS:
        raise ValueError(f"expected one of {', '.join(SCHEMAS)}, found `{table}`")
    store = store_of(out, job, options)
    taken: set[str] = set()
    parts: list[pyarrow.Table] = []
    for name in store.names("manifest", ".parquet"):
        keys = store.read_table(f"manifest/{name}", ["key"])["key"].to_pylist()
        new = [key for key in keys if key not in taken]
        part = store.read_table(f"{table}/{name}")
        if len(new) < len(keys):
            part = part.filter(pyarrow.compute.is_in(part["key"], value_set=pyarrow.array(new, pyarrow.string())))
        taken.update(new)
        parts.append(part)
    if not parts:
        return SCHEMAS[table].empty_table()
    order = [(name, "ascending") for name in ("log", "track", "start_s", "end_s", "kind") if name in SCHEMAS[table].names]
    return pyarrow.concat_tables(parts).combine_chunks().sort_by(order)
