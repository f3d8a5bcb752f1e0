"""A page of a fleet: what there is in all recordings, and which of them to look at."""

from __future__ import annotations

import html
import os
import statistics
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .._errors import Error
from .._log import Log
from ._job import Job
from ._results import read, read_manifest
from ._sources import Sources

_STYLE = """
body { font: 14px/1.5 system-ui, sans-serif; margin: 2em auto; max-width: 72em; padding: 0 1em; color: #222; background: #fff }
h1 { font-size: 1.5em } h2 { font-size: 1.15em; margin-top: 2em }
table { border-collapse: collapse } th, td { text-align: left; padding: .15em .9em .15em 0; vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums } tr + tr td { border-top: 1px solid #eee }
.bar { background: #4878a8; height: .8em; display: inline-block } a { color: #1a5fa0 } .wrong { color: #a02020 }
@media (prefers-color-scheme: dark) { body { color: #ddd; background: #181818 } tr + tr td { border-color: #333 } a { color: #7ab0e0 } .wrong { color: #e08080 } }
"""
_LISTED = 20
_OUTLYING = 3.5


def page(
    out: str,
    job: Job,
    to: str | os.PathLike[str],
    *,
    reports: int = _LISTED,
    options: Mapping[str, Any] | None = None,
) -> list[str]:
    """Writes a page of a job's results into the folder ``to``, ``index.html``; returns the recordings that it says to look at.

    Of at most ``reports`` of them it also writes the reports, analyzing them once more, and links each; one that is gone has no report.
    """
    manifest = read_manifest(out, job, options).to_pylist()
    segments = read(out, job, "segments", options=options)
    tasks = read(out, job, "tasks", options=options)
    issues = read(out, job, "issues", options=options)
    used = [row for row in manifest if row["status"] == "ok"]
    wrong = [row for row in manifest if row["status"] != "ok"]
    outliers = _outliers(used, tasks.to_pylist(), segments.to_pylist())
    os.makedirs(to, exist_ok=True)
    links = _reports(job, [log for log, _ in outliers[:reports]], os.fspath(to), options)

    def linked(log: str) -> str:
        name = html.escape(log)
        return f'<a href="{links[log]}">{name}</a>' if log in links else name

    hours = sum(row["duration_s"] or 0.0 for row in used) / 3600
    parts = [
        f"<h1>{len(manifest)} recordings, {hours:.2f} h</h1>",
        f"<p>Job {html.escape(job.digest)}: {html.escape(', '.join(job.rules) or 'the shipped rules')}"
        f"{'; ' + html.escape(os.path.basename(job.binding)) if job.binding else ''}."
        f" {len(used)} could be used, {len(wrong)} could not.</p>",
        "<h2>Tasks</h2>" + _lengths(tasks["task"].to_pylist(), tasks["start_s"].to_pylist(), tasks["end_s"].to_pylist(), tasks["log"].to_pylist()),
        "<h2>Primitives</h2>"
        + _lengths(segments["primitive"].to_pylist(), segments["start_s"].to_pylist(), segments["end_s"].to_pylist(), segments["log"].to_pylist()),
        "<h2>Issues</h2>" + _issues(issues["kind"].to_pylist(), issues["log"].to_pylist()),
        "<h2>Recordings to look at</h2>"
        + _table(("recording", "why"), ((linked(log), html.escape("; ".join(why))) for log, why in outliers[:_LISTED * 5])),
        "<h2>Recordings that cannot be used</h2>" + _wrong(wrong),
    ]
    text = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>teachtree: a fleet</title><style>{_STYLE}</style>{"".join(parts)}</html>\n'
    with open(os.path.join(to, "index.html"), "w", encoding="utf-8") as file:
        file.write(text)
    return [log for log, _ in outliers]


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    of = [' class="n"' if at in numbers else "" for at in range(len(head))]
    top = "".join(f"<th{kind}>{html.escape(name)}</th>" for name, kind in zip(head, of))
    body = "".join("<tr>" + "".join(f"<td{kind}>{cell}</td>" for cell, kind in zip(row, of)) + "</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>" if body else "<p>None.</p>"


def _lengths(names: list[str], starts: list[float], ends: list[float], logs: list[str]) -> str:
    lengths: dict[str, list[float]] = defaultdict(list)
    of: dict[str, set[str]] = defaultdict(set)
    for name, start, end, log in zip(names, starts, ends, logs):
        lengths[name].append(end - start)
        of[name].add(log)
    most = max(map(len, lengths.values()), default=1)
    rows = []
    for name, found in sorted(lengths.items(), key=lambda item: (-len(item[1]), item[0])):
        found.sort()
        tenth = [found[min(len(found) - 1, int(len(found) * share))] for share in (0.1, 0.5, 0.9)]
        bar = f'<span class="bar" style="width: {120 * len(found) / most:.0f}px"></span>'
        rows.append((html.escape(name), str(len(found)), bar, str(len(of[name])), *(f"{length:.3f}" for length in tenth), f"{sum(found):.1f}"))
    head = ("name", "count", "", "recordings", "10 % s", "median s", "90 % s", "in all s")
    return _table(head, rows, (1, 3, 4, 5, 6, 7))


def _issues(kinds: list[str], logs: list[str]) -> str:
    of: dict[str, set[str]] = defaultdict(set)
    for kind, log in zip(kinds, logs):
        of[kind].add(log)
    counts = Counter(kinds)
    rows = ((html.escape(kind), str(count), str(len(of[kind])), html.escape(min(of[kind]))) for kind, count in counts.most_common())
    return _table(("kind", "count", "recordings", "the first"), rows, (1, 2))


def _wrong(rows: list[dict[str, Any]]) -> str:
    shown = ((html.escape(row["log"]), html.escape(row["code"] or ""), f'<span class="wrong">{html.escape(row["error"] or "")}</span>') for row in rows[:100])
    more = f"<p>{len(rows) - 100} more: <code>teachtree.fleet.read(out, job, 'manifest')</code>.</p>" if len(rows) > 100 else ""
    return _table(("recording", "code", "error"), shown) + more


def _outliers(used: list[dict[str, Any]], tasks: list[dict[str, Any]], segments: list[dict[str, Any]]) -> list[tuple[str, list[str]]]:
    """The recordings to look at, those with most reasons first: unknown or no tasks, unusual sequences of tasks, lengths far from the median."""
    why: dict[str, list[str]] = defaultdict(list)
    sequences: dict[str, list[str]] = {row["log"]: [] for row in used}
    for task in tasks:
        sequences[task["log"]].append(task["task"])
    common = Counter(map(tuple, sequences.values()))
    for log, found in sequences.items():
        if not found:
            why[log].append("no task")
        elif "unknown" in found:
            why[log].append("a task that the rules do not name")
        if common[tuple(found)] * 20 < len(used):
            why[log].append(f"few recordings have the tasks {', '.join(found) or 'none'}")
    lengths: dict[tuple[str, str], list[tuple[float, str]]] = defaultdict(list)
    for row in used:
        lengths["the recording", ""].append((row["duration_s"] or 0.0, row["log"]))
    for kind, rows in (("task", tasks), ("primitive", segments)):
        for row in rows:
            lengths[kind, row[kind]].append((row["end_s"] - row["start_s"], row["log"]))
    for (_, name), values in lengths.items():
        if len(values) < 20:
            continue
        middle = statistics.median(value for value, _ in values)
        # The median deviation, as of a normal distribution; as little as 2 % of the median counts as spread.
        spread = max(1.4826 * statistics.median(abs(value - middle) for value, _ in values), 0.02 * middle, 1e-9)
        for value, log in values:
            if abs(value - middle) > _OUTLYING * spread:
                why[log].append(f"{name or 'the recording'} takes {value:.2f} s, the median is {middle:.2f} s")
    return sorted(why.items(), key=lambda item: (-len(item[1]), item[0]))


def _reports(job: Job, logs: list[str], to: str, options: Mapping[str, Any] | None) -> dict[str, str]:
    links = {}
    _, binding, scene = job.ready()
    with Sources(options) as sources:
        for at, log in enumerate(logs, 1):
            name = f"report_{at:03}.html"
            try:
                analysis = job.analyze(Log(sources.local(log), binding=binding, scene=scene, project=False))
            except (Error, OSError):
                continue
            analysis.save(os.path.join(to, name))
            links[log] = name
    return links
