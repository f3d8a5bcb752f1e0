"""Rules: definitions of primitives and tasks."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from . import _teachtree
from ._analysis import Analysis
from ._errors import Diagnostic, RulesError, diagnostic
from ._log import Binding, Log, Path, opened


@dataclass(frozen=True)
class Detectable:
    """The primitives that rules can detect in a track of a log."""

    track: str
    """``left``, ``right`` or ``both``."""
    primitives: tuple[str, ...]
    """The primitives that can be detected."""
    undetectable: Mapping[str, tuple[str, ...]]
    """The primitives that cannot be detected, by reason: a missing channel."""


class Rules:
    """Checked rules: files, a text, or the shipped ones.

    Without files and text they are those of the command line: ``contact.rules``, for a log of two hands ``bimanual.rules``, and ``failures.rules``, with
    the hand model and the params that the binding of the log names. ``params`` are values with units; they win over those of a binding.

    Raises :class:`~teachtree.RulesError`, which lists every mistake.

    >>> import teachtree
    >>> teachtree.Rules("examples/hold.rules", params={"hold_time": "200 ms"}).primitives[-1]
    'Hold'
    >>> teachtree.Rules(text='use "contact.rules"\\nprimitive Hold Hold')
    Traceback (most recent call last):
        ...
    teachtree.RulesError: ...
    """

    def __init__(
        self,
        *files: Path,
        text: str | None = None,
        params: Mapping[str, str] | None = None,
        hand: Path | None = None,
        name: str = "rules",
    ) -> None:
        self._options = _options(files, text, params, hand, name)
        self.params = dict(params or {})
        """The params that were set, with their units."""
        self._name = ", ".join([os.fspath(file) for file in files] + ([name] if text is not None else [])) or "the shipped rules"
        self._loaded: _teachtree.Rules | None = None
        try:
            self._loaded = self._options.load()
        except RulesError as error:
            # A param that is unknown may be one of a hand model that only the binding of a log names, or of the rules for two hands: it is checked
            # with that log.
            is_final = hand is not None and bool(files or text is not None)
            if is_final or not all(map(_is_unknown_param, error.diagnostics)):
                raise

    def _rules(self) -> _teachtree.Rules:
        return self._loaded if self._loaded is not None else self._options.load()

    def check(self) -> list[Diagnostic]:
        """All warnings, as ``teachtree check`` prints them; :func:`teachtree.check` also lists errors, without an exception."""
        return list(map(diagnostic, self._options.check()))

    def analyze(self, log: Log | Any, *, binding: Binding | Path | None = None) -> Analysis:
        """Finds segments and tasks in a log, or in what :class:`Log` takes.

        Other threads of Python run meanwhile, and Ctrl-C interrupts.

        >>> import teachtree
        >>> rules = teachtree.Rules()
        >>> rules.analyze("demos/robosuite/lift_demo_1.csv", binding="demos/robosuite/panda_lift.binding.yaml")
        <teachtree.Analysis of demos/robosuite/lift_demo_1.csv: pick_and_place>
        """
        log = opened(log, binding)
        return Analysis(self._options.analyze(log._inner), log)

    def detectable(self, log: Log | Any, *, binding: Binding | Path | None = None) -> list[Detectable]:
        """Which primitives can be detected in a log, by track, and which cannot, with the reason."""
        log = opened(log, binding)
        found = self._options.for_log(log._inner).observability(log._inner)
        return [
            Detectable(track, tuple(can), {reason: tuple(names) for reason, names in cannot}) for track, can, cannot in found
        ]

    @property
    def files(self) -> list[str]:
        """The files that were read, in order; shipped ones as ``rules/contact.rules``."""
        return self._rules().files

    @property
    def primitives(self) -> list[str]:
        """The names of the primitives, in order of declaration."""
        return self._rules().primitives

    @property
    def tasks(self) -> list[str]:
        """The names of the tasks, by priority: the first that matches names a task."""
        return self._rules().tasks

    @property
    def digest(self) -> str:
        """The SHA-256 of all texts and params, its first 32 hexadecimal digits. It does not depend on the paths of the files."""
        return self._rules().digest

    def svg(self) -> str:
        """The decision trees as a picture."""
        return self._rules().svg()

    def _repr_html_(self) -> str:
        """The decision trees, for notebooks."""
        return self.svg()

    def __repr__(self) -> str:
        return f"<teachtree.Rules: {self._name}>"


def _is_unknown_param(found: Diagnostic) -> bool:
    # E215 is also a value of the wrong unit, or outside the range.
    return found.code == "E215" and found.message.startswith("there is no param ")


def _options(
    files: tuple[Path, ...], text: str | None, params: Mapping[str, str] | None, hand: Path | None, name: str
) -> _teachtree.RulesOptions:
    texts = [] if text is None else [(name, text)]
    return _teachtree.RulesOptions(list(files), texts, hand, [(key, str(value)) for key, value in (params or {}).items()])


def check(
    *files: Path,
    text: str | None = None,
    params: Mapping[str, str] | None = None,
    hand: Path | None = None,
    name: str = "rules",
) -> list[Diagnostic]:
    """All errors and warnings of rules as data; raises nothing for them.

    >>> import teachtree
    >>> teachtree.check("examples/hold.rules")
    []
    >>> found = teachtree.check(text='use "contact.rules"\\nprimitive Tap')
    >>> [(one.severity, one.code) for one in found]
    [('warning', 'W201'), ('warning', 'W203')]
    """
    return list(map(diagnostic, _options(files, text, params, hand, name).check()))
