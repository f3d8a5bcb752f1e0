"""Files on disks and in object stores, by fsspec: read whole, written whole or not at all."""

from __future__ import annotations

import os
import uuid
from collections.abc import Mapping
from typing import Any

import fsspec
import pyarrow
import pyarrow.parquet


def is_url(path: str) -> bool:
    """Whether a path is in an object store."""
    return "://" in path and not path.startswith("file://")


def as_parquet(table: pyarrow.Table) -> bytes:
    """The bytes of a file of a table."""
    sink = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(table, sink, compression="zstd")
    return bytes(sink.getvalue().to_pybytes())


class Store:
    """A folder on a disk or in an object store."""

    def __init__(self, root: str, options: Mapping[str, Any] | None = None) -> None:
        self.fs, self.root = fsspec.core.url_to_fs(root, **dict(options or {}))
        self.root = self.root.rstrip("/")
        self.is_local = "file" in (self.fs.protocol if isinstance(self.fs.protocol, tuple) else (self.fs.protocol,))

    def path(self, name: str) -> str:
        return f"{self.root}/{name}"

    def exists(self, name: str) -> bool:
        """Whether a file is there now, whatever was listed before."""
        if self.is_local:
            return os.path.exists(self.path(name))
        self.fs.invalidate_cache(os.path.dirname(self.path(name)))
        return bool(self.fs.exists(self.path(name)))

    def names(self, folder: str, ending: str) -> list[str]:
        """The names of the files in a folder, in order."""
        place = self.path(folder)
        self.fs.invalidate_cache(place)
        try:
            found = self.fs.ls(place, detail=False)
        except FileNotFoundError:
            return []
        return sorted(os.path.basename(path) for path in found if path.endswith(ending))

    def read(self, name: str) -> bytes:
        return bytes(self.fs.cat_file(self.path(name)))

    def write(self, name: str, content: bytes) -> None:
        """Writes a file whole or not at all. One of this name that is there was made of the same, and may stay."""
        path = self.path(name)
        if self.is_local:
            os.makedirs(os.path.dirname(path), exist_ok=True)
            partial = f"{path}.{uuid.uuid4().hex}.partial"
            try:
                with open(partial, "xb") as file:
                    file.write(content)
                    file.flush()
                    os.fsync(file.fileno())
                os.replace(partial, path)
            finally:
                if os.path.exists(partial):
                    os.remove(partial)
            return
        # An object store shows an object when all of it is there.
        try:
            self.fs.pipe_file(path, content, mode="create")
        except FileExistsError:
            pass

    def read_table(self, name: str, columns: list[str] | None = None) -> pyarrow.Table:
        return pyarrow.parquet.read_table(pyarrow.BufferReader(self.read(name)), columns=columns)
