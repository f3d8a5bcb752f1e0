"""Rules from labeled recordings."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ._errors import Error, build
from ._log import Path


@dataclass(frozen=True)
class Learned:
    """Rules that :func:`learn` has found. ``print`` shows the rule file."""

    rules: str
    """The text of the rule file."""
    is_better: bool
    """Whether it is better than the present rules on held-out groups; of a new primitive, whether it is proved to add only; with ``start``, whether it has changes."""
    data: Mapping[str, Any]
    """The whole result, ``teachtree.learning/1``: candidates, or a new primitive with the intervals at which it was found (docs/reference/formats.md)."""

    def __str__(self) -> str:
        return self.rules


def learn(
    recordings: Path | Sequence[Path],
    *,
    labels: Path | None = None,
    new: str | None = None,
    group_by: str | None = None,
    rules: Path | Sequence[Path] = (),
    start: Path | None = None,
    hand: Path | None = None,
    binding: Path | None = None,
    track: str | None = None,
    map: str | None = None,
    jobs: int | None = None,
) -> Learned:
    """Learns rules from labeled recordings, as ``teachtree learn`` does: the same arguments give the same bytes.

    ``labels`` is a label file, or a folder with one for each recording; without it, the labels are in the recordings. ``new`` declares one new primitive,
    ``"Shake"`` or ``"Shake is Translate"``, which extends ``rules``; recordings without labels may be among the others. ``start`` is a rule file whose guards
    and numbers are learned again. Without either, the rules have all labels. ``group_by`` is a regular expression whose first parentheses name the group of a
    recording, such as the person. ``map`` renames labels: ``"S1=Move,S9=mask"``. Nothing is written: write ``str(learned)`` to a file. docs/learning.md
    describes the method.

    Raises :class:`~teachtree.ArgumentError` if nothing can be learned from the recordings, and the errors of :class:`~teachtree.Log` and
    :class:`~teachtree.Rules`.

    >>> import teachtree
    >>> teachtree.learn("no_such_folder", new="Shake")
    Traceback (most recent call last):
        ...
    teachtree.NotFound: no_such_folder: there is no such file
    """
    words = ["learn", *_paths(recordings), *([] if start else ["--anyway"]), "--format", "json", "--quiet"]
    for option, paths in (("--rules", rules), ("--from", start or ()), ("--labels", labels or ()), ("--hand", hand or ()), ("--binding", binding or ())):
        words += [word for path in _paths(paths) for word in (option, path)]
    for option, value in (("--new", new), ("--group-by", group_by), ("--track", track), ("--map", map), ("--jobs", jobs)):
        words += [] if value is None else [f"{option}={value}"]
    # A process of its own: Ctrl-C ends it.
    command = [sys.executable, "-P", "-m", "teachtree", *words]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False, env={**os.environ, "TEACHTREE_ERROR_KIND": "1"})
    # The status is 1 without better rules, and also after some errors.
    if done.returncode not in (0, 1) or not done.stdout:
        raise _error(done.stderr)
    data = json.loads(done.stdout)
    return Learned(data["rules"], data["better"], data)


def _paths(paths: Path | Sequence[Path]) -> list[str]:
    return [os.fspath(path) for path in ([paths] if isinstance(paths, (str, os.PathLike)) else paths)]


def _error(said: str) -> Error:
    """The error that the command line has printed."""
    kinds = [line.removeprefix("kind: ") for line in said.splitlines() if line.startswith("kind: ")]
    said = "\n".join(line for line in said.splitlines() if not line.startswith("kind: "))
    rendered = said.strip().removeprefix("error: ")
    first, _, rest = rendered.partition("\n")
    place, _, message = first.partition(": ")
    help = rest.strip().removeprefix("help: ") or None
    # A mistake on the command line has no kind.
    kind = kinds[0] if kinds else "argument"
    return build(kind, "" if kind == "rules" else place, message or first, help, rendered, [])
