"""Recordings of object stores on this machine: each file or set is fetched once for a shard, without its videos."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from types import TracebackType
from typing import Any

import fsspec

from ._store import is_url

LOGS = (".csv", ".tsv", ".parquet", ".jsonl", ".ndjson", ".mcap", ".bag", ".hdf5", ".h5", ".hdf", ".npz", ".npy", ".zarr.zip")
SETS = (".hdf5", ".h5", ".hdf", ".zarr.zip")
COMPANIONS = (".labels.csv", "_segments.csv", ".events.csv")


def beside(path: str) -> list[str]:
    """The files that may stand beside a log: of `a.csv` those are `a.scene.yaml`, `a.csv.scene.yaml`, and the same of its events."""
    return [f"{name}.{ending}" for ending in ("scene.yaml", "events.csv") for name in (os.path.splitext(path)[0], path)]


class Sources:
    """Gives a recording a path on this machine."""

    def __init__(self, options: Mapping[str, Any] | None) -> None:
        self._options = dict(options or {})
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._known: dict[str, str] = {}

    def __enter__(self) -> Sources:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._folder is not None:
            self._folder.cleanup()

    def local(self, path: str) -> str:
        """The path of a recording; what is in an object store is fetched."""
        if not is_url(path):
            return path
        base, mark, episode = path.partition("#")
        if base not in self._known:
            self._known[base] = self._fetch(base)
        return self._known[base] + mark + episode

    def _fetch(self, url: str) -> str:
        self._folder = self._folder or tempfile.TemporaryDirectory(prefix="teachtree-fetched-")
        # A new folder for each try: one that failed leaves a part.
        place = tempfile.mkdtemp(dir=self._folder.name)
        fs, path = fsspec.core.url_to_fs(url, **self._options)
        local = os.path.join(place, os.path.basename(path))
        if fs.isdir(path):
            for part in ("meta", "data"):
                for file in fs.find(f"{path}/{part}"):
                    self._get(fs, file, os.path.join(local, file[len(path) + 1 :]))
            return local
        self._get(fs, path, local)
        for other in beside(path):
            if fs.exists(other):
                self._get(fs, other, os.path.join(place, os.path.basename(other)))
        return local

    def _get(self, fs: Any, path: str, local: str) -> None:
        os.makedirs(os.path.dirname(local), exist_ok=True)
        fs.get_file(path, local)
