"""Which recordings there are, which of them are not done, and how they are divided."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import fsspec

from .._errors import Error
from .._log import recordings as listed
from ._job import Job
from ._results import done_keys
from ._sources import COMPANIONS, LOGS, SETS, beside
from ._store import is_url

SHARD_SIZE = 64


@dataclass(frozen=True)
class Recording:
    """A recording, and its identity, by which a changed recording is detected."""

    path: str
    """As :class:`teachtree.Log` takes it; in an object store a URL, with ``#3`` behind it for an episode."""
    identity: str
    """Of files their size and time; of objects their size and ETag."""

    def key(self, job: Job) -> str:
        """The name of what a job makes of it."""
        return hashlib.sha256("\0".join((job.digest, self.path, self.identity)).encode(errors="surrogateescape")).hexdigest()[:32]


@dataclass(frozen=True)
class Shard:
    """Some recordings that are done together: the unit of work, of retry and of commit."""

    name: str
    """Made of the keys of its recordings."""
    recordings: tuple[Recording, ...]

    @classmethod
    def of(cls, job: Job, recordings: Sequence[Recording]) -> Shard:
        keys = "".join(recording.key(job) for recording in recordings)
        return cls(hashlib.sha256(keys.encode()).hexdigest()[:32], tuple(recordings))


@dataclass(frozen=True)
class Plan:
    """What is to be done."""

    shards: tuple[Shard, ...]
    skipped: int
    """How many recordings are done already."""

    def __len__(self) -> int:
        return sum(len(shard.recordings) for shard in self.shards)


def plan(
    sources: Iterable[str | os.PathLike[str] | Recording],
    job: Job,
    out: str,
    *,
    shard_size: int = SHARD_SIZE,
    shard: tuple[int, int] | None = None,
    options: Mapping[str, Any] | None = None,
) -> Plan:
    """Divides the recordings that are not done yet into shards of at most ``shard_size``.

    ``sources`` are those of :func:`recordings`, or a manifest of :class:`Recording`. ``shard`` is ``(I, N)``, ``I`` from 1: only the ``I``-th of ``N``
    parts, for arrays of jobs. A recording is in the same part whatever else is done meanwhile. Results that are in a folder of the sources are no
    recordings.
    """
    if shard_size < 1 or shard is not None and not 1 <= shard[0] <= shard[1]:
        raise ValueError(f"expected a shard size from 1 and a part I/N with I from 1 to N, found {shard_size} and {shard}")
    found: dict[str, Recording] = {}
    results = f"{os.fspath(out).rstrip('/')}/job="
    results = results if is_url(results) else os.path.abspath(results)
    for recording in _recordings(sources, job.binding, options):
        if (recording.path if is_url(recording.path) else os.path.abspath(recording.path)).startswith(results):
            continue
        if shard is None or int(hashlib.sha256(recording.path.encode(errors="surrogateescape")).hexdigest()[:12], 16) % shard[1] == shard[0] - 1:
            found[recording.path] = recording
    ordered = [found[path] for path in sorted(found)]
    known = done_keys(out, job, options)
    left = [recording for recording in ordered if recording.key(job) not in known]
    shards = (Shard.of(job, left[at : at + shard_size]) for at in range(0, len(left), shard_size))
    return Plan(tuple(shards), len(ordered) - len(left))


def recordings(
    sources: Iterable[str | os.PathLike[str]],
    *,
    binding: str | os.PathLike[str] | None = None,
    options: Mapping[str, Any] | None = None,
) -> list[Recording]:
    """The recordings in folders, LeRobot sets, files and object stores, each with its identity: a manifest, which can be kept.

    A folder of files is a recording for each; ``"set#*"`` and ``"set#0..9"`` are episodes. URLs are those of fsspec (``s3://bucket/logs``,
    ``gs://…``, ``hf://datasets/…``), ``options`` its storage options.
    """
    return list(_recordings(sources, None if binding is None else os.fspath(binding), options))


def _recordings(
    sources: Iterable[str | os.PathLike[str] | Recording], binding: str | None, options: Mapping[str, Any] | None
) -> Iterable[Recording]:
    identity = lru_cache(maxsize=1024)(_identity)
    for source in sources:
        if isinstance(source, Recording):
            yield source
        elif is_url(os.fspath(source)):
            yield from _remote(os.fspath(source), binding, options)
        else:
            name = os.fspath(source)
            if not os.path.exists(name) and not os.path.exists(name.partition("#")[0]):
                raise FileNotFoundError(f"{name}: there is no such file or folder")
            for path in listed(name, binding=binding):
                yield Recording(path, identity(path.split("#")[0]))


def _identity(path: str) -> str:
    """Size and time of a file and of those beside it; of a folder those of all files but videos."""
    found = []
    if os.path.isdir(path):
        for folder, _, names in os.walk(path):
            found += [os.path.join(folder, name) for name in names if not name.endswith((".mp4", ".png", ".jpg"))]
    else:
        found = [path, *beside(path)]
    facts = []
    for file in sorted(found):
        try:
            stat = os.stat(file)
        except OSError:
            continue
        facts.append((os.path.basename(file), stat.st_size, stat.st_mtime_ns))
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:32]


def _remote(url: str, binding: str | None, options: Mapping[str, Any] | None) -> Iterable[Recording]:
    base, _, choice = url.partition("#")
    fs, root = fsspec.core.url_to_fs(base, **dict(options or {}))
    fs.invalidate_cache()
    root = root.rstrip("/")
    scheme = base.split("://")[0]
    found: dict[str, dict[str, Any]] = fs.find(root, detail=True)
    if not found and fs.exists(root):
        found = {root: fs.info(root)}
    if not found:
        raise FileNotFoundError(f"{base}: there is no such object")
    sets = sorted({path[: -len("/meta/info.json")] for path in found if path.endswith("/meta/info.json")})
    for folder in sets:
        of_set = {path: info for path, info in found.items() if path.startswith(f"{folder}/") and not path.endswith(".mp4")}
        fact = _fact(of_set)
        episodes = range(int(json.loads(fs.cat_file(f"{folder}/meta/info.json"))["total_episodes"]))
        for episode in _chosen(choice, episodes) if choice else episodes:
            yield Recording(f"{scheme}://{folder}#{episode}", fact)
    for path in sorted(found):
        if any(path.startswith(f"{folder}/") for folder in sets):
            continue
        if path != root and (not path.lower().endswith(LOGS) or path.lower().endswith(COMPANIONS)):
            continue
        fact = _fact({path: found[path], **{other: found[other] for other in beside(path) if other in found}})
        if path.lower().endswith(SETS):
            # Which demonstrations a file has is only known of the file.
            with tempfile.TemporaryDirectory() as folder:
                local = os.path.join(folder, os.path.basename(path))
                fs.get_file(path, local)
                try:
                    names = listed(f"{local}#{choice}" if choice else folder, binding=binding)
                except Error:
                    # A file that cannot be read is a recording that cannot be used.
                    names = [local]
            for name in names:
                yield Recording(f"{scheme}://{path}" + "".join(name.partition("#")[1:]), fact)
        else:
            yield Recording(f"{scheme}://{path}" + (f"#{choice}" if choice else ""), fact)


def _fact(found: Mapping[str, Mapping[str, Any]]) -> str:
    facts = []
    for path, info in sorted(found.items()):
        version = info.get("ETag") or info.get("etag") or info.get("mtime") or info.get("LastModified") or ""
        facts.append((os.path.basename(path), info.get("size"), str(version)))
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:32]


def _chosen(choice: str, episodes: range) -> Iterable[int]:
    if choice == "*":
        return episodes
    first, dots, last = choice.partition("..")
    return range(int(first), int(last) + 1) if dots else [int(first)]
