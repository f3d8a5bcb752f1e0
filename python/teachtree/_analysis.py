"""The result of rules on a log."""

from __future__ import annotations

import html
import json
import os
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from . import _teachtree
from ._errors import NotFound
from ._table import Table

if TYPE_CHECKING:
    from ._log import Log, Path

_FRAME_HEIGHT = 640


class Explanation:
    """Why tracks have their labels. ``str()`` draws it as ``teachtree explain`` does."""

    def __init__(self, text: str, data: str) -> None:
        self.text = text
        """The text that the command line prints."""
        self.json = data
        """``teachtree.explain/1`` (docs/formats.md)."""

    @property
    def data(self) -> dict[str, Any]:
        """The JSON as plain data."""
        return dict(json.loads(self.json))

    def __str__(self) -> str:
        return self.text

    __repr__ = __str__


class Score:
    """An analysis compared with labels. ``str()`` gives the tables of ``teachtree score``."""

    def __init__(self, text: str, data: str, svg: str, warnings: Sequence[str]) -> None:
        self.text = text
        """The tables that the command line prints."""
        self.json = data
        """``teachtree.score/1`` (docs/formats.md)."""
        self.svg = svg
        """Confusions and boundary errors as a picture."""
        self.warnings = tuple(warnings)
        """Remarks about the labels."""

    @property
    def data(self) -> dict[str, Any]:
        """The JSON as plain data."""
        return dict(json.loads(self.json))

    @property
    def accuracy(self) -> float | None:
        """The share of the labeled time with the true primitive; ``None`` where no time is labeled."""
        found: float | None = self.data["results"][0]["all"]["accuracy"]
        return found

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"<teachtree.Score: accuracy {self.accuracy}>"

    def _repr_html_(self) -> str:
        """The picture, for notebooks."""
        return self.svg


@dataclass(frozen=True)
class OutcomeReason:
    """A reason of an outcome."""

    kind: str
    """``succeeded``, ``mended``, ``declared``, ``failed``, ``let_fall``, ``cut_off``, ``missing``, ``not_measured``, ``no_task``,
    ``no_criterion``, ``unseen_failure`` or ``misread`` (docs/outcomes.md)."""
    track: str | None
    """The hand; ``None`` if the reason concerns the recording."""
    task: str | None
    """The task; ``None`` if the reason concerns no task."""
    start_s: float | None
    """When the task starts, s."""
    end_s: float | None
    """When the task ends, s."""
    message: str
    """The reason in words."""

    def __str__(self) -> str:
        return self.message


@dataclass(frozen=True)
class RecordingOutcome:
    """Whether a recording is a success (docs/outcomes.md). ``str()`` gives the line of ``teachtree analyze``."""

    result: str
    """``success``, ``failure`` or ``unknown``."""
    attempts: int
    """The most attempts at one object and target; 0 without a task."""
    expected: str | None
    """The tasks that the recording should contain; ``None`` without an expectation."""
    as_expected: bool | None
    """Whether it contains them; ``None`` without an expectation."""
    text: str
    """The result with its first reasons, in words."""
    reasons: tuple[OutcomeReason, ...]
    """The reasons of the result."""

    def __str__(self) -> str:
        return self.text


class Analysis:
    """The result of rules on a log: segments, tasks, issues, values per frame, reasons.

    >>> import teachtree
    >>> analysis = teachtree.analyze("demos/robosuite/lift_demo_1.csv", binding="demos/robosuite/panda_lift.binding.yaml")
    >>> for task in analysis.tasks.rows():
    ...     print(task["track"], task["task"], task["object"])
    right pick_and_place cube
    """

    def __init__(self, inner: _teachtree.Analysis, log: Log) -> None:
        self._inner = inner
        self.log = log
        """The log that was analyzed."""

    @property
    def segments(self) -> Table:
        """The segments after relabeling, by track and time.

        Columns: ``track``, ``primitive``, ``object``, ``partner``, ``start_s``, ``end_s``, ``start_row``, ``end_row``, ``start_frame``, ``end_frame``,
        ``task`` (its number in the track, from 1), ``was``, ``by``; after :meth:`with_confidence` also ``confidence``, ``stability``,
        ``earliest_s``, ``latest_s``, ``margin``. docs/formats.md describes each; ends are exclusive.
        """
        return Table(self._inner.segments())

    @property
    def raw_segments(self) -> Table:
        """The segments as the trees returned them, settled, before relabeling."""
        return Table(self._inner.segments(True))

    @property
    def tasks(self) -> Table:
        """The tasks, by track and time.

        Columns: ``track``, ``task``, ``object``, ``partner``, times, rows, frames, ``attempt``, ``failure``, ``secondary``, ``cut_at_start``, ``cut_at_end``.
        """
        return Table(self._inner.tasks())

    @property
    def outcome(self) -> RecordingOutcome:
        """Whether the recording is a success, with the reasons (docs/outcomes.md).

        >>> import teachtree
        >>> analysis = teachtree.analyze("demos/robosuite/stack_panda_demo_1.csv", binding="demos/robosuite/panda_stack.binding.yaml")
        >>> analysis.outcome.reasons[0].kind
        'succeeded'
        >>> analysis.expecting("pick_and_place").outcome.result
        'success'
        """
        result, attempts, expected, as_expected, text, reasons = self._inner.outcome
        return RecordingOutcome(result, attempts, expected, as_expected, text, tuple(OutcomeReason(*reason) for reason in reasons))

    def expecting(self, tasks: str) -> Analysis:
        """The same analysis with other expected tasks, in order: ``"peg_in_hole x 2, turn_screw"``."""
        return Analysis(self._inner.expecting(tasks), self.log)

    @property
    def issues(self) -> Table:
        """Faults of the log and their treatment; with a binding also the primitives that cannot be detected."""
        return Table(self._inner.issues())

    def frames(self, signals: Sequence[str] = ()) -> Table:
        """A row per frame: ``time [s]``, ``row``, the signals, latches and channels that are named, and labels, tasks and objects of each track.

        Numbers are in SI with the unit after the name, as in the table of ``teachtree analyze --frames``; NaN and null where nothing is known.

        >>> import teachtree
        >>> analysis = teachtree.analyze("demos/robosuite/lift_demo_1.csv", binding="demos/robosuite/panda_lift.binding.yaml")
        >>> analysis.frames(["near"]).column_names[:4]
        ['time [s]', 'row', 'right.near', 'right.raw']
        """
        return Table(self._inner.frames([signals] if isinstance(signals, str) else list(signals)))

    def explain(self, start_s: float, end_s: float | None = None, *, track: str | None = None) -> Explanation:
        """Why tracks have their labels at a time, or from one time to another, s."""
        return Explanation(*self._inner.explain(start_s, start_s if end_s is None else end_s, track))

    def why_not(self, start_s: float, primitive: str, *, end_s: float | None = None, track: str | None = None) -> Explanation:
        """Why the label at a time is not another primitive: the nearest path to it in the tree, and which conditions on it fail."""
        return Explanation(*self._inner.explain(start_s, start_s if end_s is None else end_s, track, primitive))

    def score(self, labels: Path | None = None, *, track: str | None = None, map: str | None = None) -> Score:
        """Compares the result with labels: those of the log (``right.label``), or a file or folder of docs/score.md.

        ``track`` is what labels without a column ``track`` are about; ``map`` goes from foreign names to those of the rules,
        ``"S1=Move|Approach,S2=Grasp,S9=mask"`` or a YAML file.
        """
        return Score(*self._inner.score(labels, track, map))

    def with_confidence(self) -> Analysis:
        """The same analysis with the confidence of each boundary and the stability of each task (docs/formats.md); takes about ten times as long."""
        return Analysis(self._inner.with_confidence(), self.log)

    def json(self) -> str:
        """``teachtree.analysis/2`` (docs/formats.md): the bytes of ``teachtree analyze --format json``."""
        return self._inner.json()

    def json_line(self) -> str:
        """The same document on one line, for JSON lines."""
        return self._inner.json_line()

    @property
    def data(self) -> dict[str, Any]:
        """The JSON as plain data."""
        return dict(json.loads(self.json()))

    def csv(self) -> str:
        """Segments and tasks as a CSV table (docs/formats.md)."""
        return self._inner.csv()

    def html(self) -> str:
        """The report (docs/report.md): a page for browsers that needs no network."""
        return self._inner.html()

    @property
    def tracks(self) -> list[str]:
        """The tracks that the log has: ``left``, ``right``, ``both``."""
        return self._inner.tracks

    @property
    def digest(self) -> str:
        """The digest of the rules and params that were run."""
        return self._inner.rules.digest

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return self._inner.span[0]

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return self._inner.span[1]

    @property
    def start_s(self) -> float:
        """When the log starts, s."""
        return self._inner.span[2]

    @property
    def end_s(self) -> float:
        """When the log ends, s."""
        return self._inner.span[3]

    def __str__(self) -> str:
        return self._inner.text()

    def __repr__(self) -> str:
        tasks = ", ".join(self.tasks["task"]) or "no task"
        return f"<teachtree.Analysis of {self.log.name}: {tasks}>"

    def _repr_html_(self) -> str:
        """The report in a frame, for notebooks: lanes, plots and the replay, without a network."""
        page = html.escape(self.html(), quote=True)
        style = f"width: 100%; height: {_FRAME_HEIGHT}px; border: 0"
        return f'<iframe sandbox="allow-scripts" style="{style}" srcdoc="{page}"></iframe>'

    def save(self, path: Path) -> None:
        """Writes the analysis as ``.json``, ``.csv`` or ``.html``, by the ending of the name; a file is complete or absent."""
        ending = os.path.splitext(os.fspath(path))[1]
        forms = {".json": self.json, ".csv": self.csv, ".html": self.html}
        if ending not in forms:
            from ._log import _argument

            raise _argument(os.fspath(path), f"expected a name in .json, .csv or .html, found `{ending}`", None)
        partial = f"{os.fspath(path)}.{uuid.uuid4().hex}.partial"
        try:
            with open(partial, "w", encoding="utf-8", newline="") as file:
                file.write(forms[ending]())
            os.replace(partial, path)
        except OSError as error:
            message = f"cannot be written: {error.strerror}"
            raise NotFound(f"{os.fspath(path)}: {message}", "io", os.fspath(path), message) from None
        finally:
            if os.path.exists(partial):
                os.remove(partial)
