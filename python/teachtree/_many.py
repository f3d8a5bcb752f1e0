"""One recording and many."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from ._analysis import Analysis
from ._errors import Error
from ._log import Binding, Log, Path, _argument, recordings
from ._rules import Rules


@dataclass(frozen=True)
class Outcome:
    """The result of one of many recordings."""

    path: str
    """The recording."""
    analysis: Analysis | None
    """The analysis; ``None`` if the recording cannot be used."""
    error: Error | None
    """The error; ``None`` if the recording was analyzed."""


def analyze(log: Log | Any, *, rules: Rules | None = None, binding: Binding | Path | None = None) -> Analysis:
    """Analyzes a log, or what :class:`Log` takes, by the shipped rules or one's own: ``teachtree analyze``."""
    return _rules(rules).analyze(log, binding=binding)


def analyze_many(
    paths: Path | Sequence[Path],
    *,
    rules: Rules | None = None,
    binding: Binding | Path | None = None,
    jobs: int | None = None,
) -> Iterator[Outcome]:
    """Analyzes the recordings of paths, folders and ``"set#*"`` on ``jobs`` cores, all of them by default, in the order of their names.

    A recording that cannot be used is an :class:`Outcome` with its error; the others go on. At most ``2 · jobs`` analyses wait to be taken, so
    memory does not grow with the number of recordings.

    >>> import teachtree
    >>> for found in teachtree.analyze_many("demos/robosuite/lift.hdf5#*", binding="demos/robosuite/lift_hdf5.binding.yaml"):
    ...     print(found.path, found.analysis.tasks["task"])
    demos/robosuite/lift.hdf5#demo_1 ['unknown', 'pick_and_place']
    demos/robosuite/lift.hdf5#demo_3 ['unknown', 'pick_and_place']
    """
    listed = recordings(paths, binding=binding)
    rules = _rules(rules)
    jobs = jobs or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else jobs or os.cpu_count() or 1
    return _each(listed, rules, binding, max(1, jobs))


def _rules(rules: Rules | None) -> Rules:
    if rules is not None and not isinstance(rules, Rules):
        raise _argument("rules", f"expected Rules, found {type(rules).__name__}", "write `teachtree.Rules(…)` around a file")
    return Rules() if rules is None else rules


def _one(path: str, rules: Rules, binding: Binding | Path | None) -> Outcome:
    try:
        return Outcome(path, rules.analyze(path, binding=binding), None)
    except Error as error:
        return Outcome(path, None, error)


def _each(paths: list[str], rules: Rules, binding: Binding | Path | None, jobs: int) -> Iterator[Outcome]:
    pool = ThreadPoolExecutor(jobs, thread_name_prefix="teachtree")
    waiting: deque[Future[Outcome]] = deque()
    try:
        for path in paths:
            if len(waiting) >= 2 * jobs:
                yield waiting.popleft().result()
            waiting.append(pool.submit(_one, path, rules, binding))
        while waiting:
            yield waiting.popleft().result()
    finally:
        # Where the caller stops early, or presses Ctrl-C, what has not begun is left.
        pool.shutdown(wait=False, cancel_futures=True)
