"""Where two jobs differ over all recordings that both did."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import pyarrow

from ._job import Job
from ._results import read, read_manifest

_SCHEMA = pyarrow.schema(
    [
        ("log", pyarrow.string()),
        ("track", pyarrow.string()),
        ("start_s", pyarrow.float64()),
        ("end_s", pyarrow.float64()),
        ("a", pyarrow.string()),
        ("b", pyarrow.string()),
    ]
)

Spans = list[tuple[float, float, str]]


@dataclass(frozen=True)
class Diff:
    """Where two jobs give different primitives. ``str()`` lists the changes, most time first, with an example each."""

    table: pyarrow.Table
    """A row for each interval: ``log``, ``track``, ``start_s``, ``end_s``, and the primitives ``a`` and ``b``, null for none."""
    recordings: int
    """How many recordings both jobs did."""
    only_a: tuple[str, ...]
    """Recordings that only the first one could use."""
    only_b: tuple[str, ...]
    """Recordings that only the second one could use."""

    def summary(self) -> list[dict[str, Any]]:
        """A row for each pair of primitives, most time first: seconds, intervals, recordings, and the longest interval as ``example``."""
        found: dict[tuple[str, str], dict[str, Any]] = {}
        logs: dict[tuple[str, str], set[str]] = defaultdict(set)
        longest: dict[tuple[str, str], float] = defaultdict(float)
        for row in self.table.to_pylist():
            pair = (row["a"] or "", row["b"] or "")
            seconds = row["end_s"] - row["start_s"]
            of = found.setdefault(pair, {"a": row["a"], "b": row["b"], "seconds": 0.0, "intervals": 0, "recordings": 0, "example": row})
            of["seconds"] += seconds
            of["intervals"] += 1
            logs[pair].add(row["log"])
            if seconds > longest[pair]:
                longest[pair], of["example"] = seconds, row
        for pair, of in found.items():
            of["recordings"] = len(logs[pair])
        return sorted(found.values(), key=lambda of: (-of["seconds"], of["a"] or "", of["b"] or ""))

    def by_recording(self) -> list[tuple[str, float]]:
        """The recordings that differ, with how many seconds, most first."""
        seconds: dict[str, float] = defaultdict(float)
        for row in self.table.to_pylist():
            seconds[row["log"]] += row["end_s"] - row["start_s"]
        return sorted(seconds.items(), key=lambda found: (-found[1], found[0]))

    def __str__(self) -> str:
        differing = len(set(self.table["log"].to_pylist()))
        lines = [f"{differing} of {self.recordings} recordings differ"]
        for of in self.summary():
            example = of["example"]
            where = f"{example['log']} {example['track']} {example['start_s']:.3f} – {example['end_s']:.3f} s"
            change = f"{of['a'] or 'none'} → {of['b'] or 'none'}"
            lines.append(f"  {change:<32} {of['seconds']:10.3f} s in {of['recordings']} recordings, such as {where}")
        for name, only in (("first", self.only_a), ("second", self.only_b)):
            if only:
                lines.append(f"  only the {name} job could use {len(only)} recordings, such as {only[0]}")
        return "\n".join(lines)


def diff(out: str, a: Job | str, b: Job | str, *, options: Mapping[str, Any] | None = None) -> Diff:
    """Compares the segments of two jobs (or digests of jobs) in a folder of results, over the recordings that both did."""
    used = [_used(read_manifest(out, job, options)) for job in (a, b)]
    both = used[0] & used[1]
    spans = [_spans(read(out, job, "segments", options=options), both) for job in (a, b)]
    rows: list[dict[str, Any]] = []
    for log, track in sorted({*spans[0], *spans[1]}):
        for start, end, one, other in _differing(spans[0].get((log, track), []), spans[1].get((log, track), [])):
            rows.append({"log": log, "track": track, "start_s": start, "end_s": end, "a": one, "b": other})
    table = pyarrow.Table.from_pylist(rows, _SCHEMA)
    return Diff(table, len(both), tuple(sorted(used[0] - both)), tuple(sorted(used[1] - both)))


def _used(manifest: pyarrow.Table) -> set[str]:
    rows = zip(manifest["log"].to_pylist(), manifest["status"].to_pylist())
    return {log for log, status in rows if status == "ok"}


def _spans(segments: pyarrow.Table, logs: set[str]) -> dict[tuple[str, str], Spans]:
    found: dict[tuple[str, str], Spans] = defaultdict(list)
    columns = (segments[name].to_pylist() for name in ("log", "track", "start_s", "end_s", "primitive"))
    for log, track, start, end, primitive in zip(*columns):
        if log in logs:
            found[log, track].append((start, end, primitive))
    return found


def _differing(a: Spans, b: Spans) -> Iterator[tuple[float, float, str | None, str | None]]:
    """The intervals in which two lists of spans, each in order of time, have different labels; neighbors with one change are one."""
    times = sorted({time for start, end, _ in (*a, *b) for time in (start, end)})
    at = [0, 0]
    held: tuple[float, float, str | None, str | None] | None = None
    for start, end in zip(times, times[1:]):
        labels: list[str | None] = []
        for place, spans in enumerate((a, b)):
            while at[place] < len(spans) and spans[at[place]][1] <= start:
                at[place] += 1
            span = spans[at[place]] if at[place] < len(spans) else None
            labels.append(span[2] if span and span[0] <= start else None)
        if labels[0] == labels[1]:
            continue
        if held and held[1] == start and held[2:] == (labels[0], labels[1]):
            held = (held[0], end, labels[0], labels[1])
        else:
            if held:
                yield held
            held = (start, end, labels[0], labels[1])
    if held:
        yield held
