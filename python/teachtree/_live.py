"""Rules that run on a log while it is recorded."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from . import _teachtree
from ._errors import NotFound
from ._log import Binding, Log, Path, Scene, opened
from ._rules import Rules


@dataclass(frozen=True)
class Event:
    """An event of a live log."""

    sequence: int
    """0, 1, 2, …: a gap shows a missing event."""
    name: str
    """``label``: the primitive of a track at the newest frame, if the log ended there; ``segment``, ``task``: one that has closed; ``issue``."""
    final: bool
    """Whether no later row can change it."""
    data: dict[str, Any] = field(repr=False)
    """``teachtree.live/1`` (docs/formats.md) as plain data."""

    @property
    def track(self) -> str | None:
        """``left``, ``right`` or ``both``; ``None`` for an issue."""
        return self.data.get("track")

    @property
    def primitive(self) -> str | None:
        """The primitive of a label or a segment."""
        return self.data.get("primitive")

    @property
    def confidence(self) -> float | None:
        """The confidence of a label, with ``Live(…, confidence=True)``: the share of labels that had stood as long and were confirmed, at most 0.88 (docs/live.md)."""
        return self.data.get("confidence")


class Calibration:
    """The properties that an analysis learns from a log: rate, bias and contact level of sensors, contacts.

    ``whole`` learns from all of ``log`` as its analysis does: the final events then are those of the analysis.
    """

    def __init__(self, rules: Rules, log: Log | Any, *, whole: bool = False, binding: Binding | Path | None = None) -> None:
        log = opened(log, binding)
        self._rules = rules._options.for_log(log._inner)
        self._inner = _teachtree.Calibration(self._rules, log._inner, whole)

    @classmethod
    def read(cls, path: Path, rules: Rules) -> Calibration:
        """Reads a calibration file, as ``teachtree inspect LOG --calibrate FILE`` and :meth:`text` write it."""
        made = cls.__new__(cls)
        made._rules = rules._rules()
        made._inner = _teachtree.Calibration.parse(os.fspath(path), _text(path))
        return made

    def text(self) -> str:
        """The text of a calibration file."""
        return self._inner.text()

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return self._inner.rate_hz


class Live:
    """A log that is being recorded: takes rows and returns events, in constant memory.

    ``columns`` are the names of the values of a row, as in docs/logs.md, ``time`` among them; ``scene`` has the bodies and hands.
    With ``confidence`` labels have their confidence, and are repeated when it changes.

    >>> import teachtree
    >>> scene = teachtree.Scene("{bodies: {cube: {role: object, radius: 20 mm}}, hands: {right: {fingers: [thumb, index]}}}")
    >>> names = ["time"] + [f"right.{finger}.{what}.{axis}" for finger in ("thumb", "index") for what in ("position", "force") for axis in "xyz"]
    >>> names += [f"cube.position.{axis}" for axis in "xyz"]
    >>> rest = teachtree.Log({name: [0.01 * row if name == "time" else 0.3 for row in range(100)] for name in names}, scene=scene)
    >>> live = teachtree.Live(teachtree.Calibration(teachtree.Rules(), rest), names, scene=scene)
    >>> [event.primitive for event in live.push([1.0] + [0.3] * 15)]
    []
    """

    def __init__(self, calibration: Calibration, columns: Sequence[str], *, scene: Scene | Path, confidence: bool = False) -> None:
        if not isinstance(scene, Scene):
            scene = Scene(_text(scene))
        self._inner = _teachtree.Live(calibration._rules, list(columns), scene.text, calibration._inner, confidence)

    def push(self, row: Any) -> list[Event]:
        """Takes a row: a sequence of numbers, or faster an array of doubles. A missing value is NaN."""
        lines = self._inner.push(row)
        return [_event(line) for line in lines] if lines else []

    def finish(self) -> list[Event]:
        """Ends the log and returns the remaining segments and tasks."""
        return [_event(line) for line in self._inner.finish()]

    @property
    def lag_s(self) -> float | None:
        """The delay of segments, s, without relabeling and tasks; ``None`` before the first rows."""
        return self._inner.lag_s


def _text(path: Path) -> str:
    try:
        with open(path, encoding="utf-8") as file:
            return file.read()
    except OSError as error:
        message = f"cannot be read: {error.strerror}"
        raise NotFound(f"{os.fspath(path)}: {message}", "io", os.fspath(path), message) from None


def _event(line: str) -> Event:
    data = json.loads(line)
    return Event(data["sequence"], data["event"], data["final"], data)
