"""Recordings: files of any format, Arrow tables, arrays."""

from __future__ import annotations

import math
import os
from array import array
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from . import _teachtree
from ._errors import ArgumentError

Path = str | os.PathLike[str]


class Binding:
    """A binding: which columns of a foreign log are which channels (docs/bindings.md), with a scene where the binding names none.

    >>> import teachtree
    >>> lift = teachtree.Binding("demos/robosuite/panda_lift.binding.yaml")
    >>> teachtree.Log("demos/robosuite/lift_demo_1.csv", binding=lift).hands
    ['right']
    """

    def __init__(self, path: Path, scene: Path | None = None) -> None:
        self.path = os.fspath(path)
        """The file."""
        self.scene = None if scene is None else os.fspath(scene)
        """A scene instead of the one that the binding names."""

    def __repr__(self) -> str:
        return f"teachtree.Binding({self.path!r})"

    def __fspath__(self) -> str:
        return self.path


class Scene:
    """The bodies and hands of a log in memory (docs/scenes.md), as the text of a scene file."""

    def __init__(self, text: str) -> None:
        self.text = text
        """YAML."""


class Log:
    """A recording of hands and objects.

    ``source`` is a path (a file or folder of any format of docs/logs.md, ``"set#3"`` for an episode of a data set), a table of any library that
    speaks the Arrow PyCapsule interface (pyarrow, polars, pandas 3, duckdb, …), or a mapping from names to arrays.

    The columns of tables and mappings have the names of docs/logs.md, such as ``time``, ``right.thumb.force.x``, ``cube.position.x``, or those that
    ``binding`` expects. A unit follows the name, ``"right.thumb.force.x [mN]"``, or is in ``units``; without one, values are in the unit that
    docs/logs.md gives for the name. What was not measured is NaN or null. A list or a row of a matrix is a column for each place, ``state[0]``.

    What is not named here is taken from the nearest ``teachtree.yaml`` above the file (docs/project.md); ``project=False`` leaves that file out.

    ``datasets.Dataset`` does not speak Arrow itself: pass ``dataset.data.table``.

    >>> import teachtree
    >>> log = teachtree.Log(
    ...     {"time": [0.0, 0.01, 0.02], "cube.position.x": [0.0, 1.0, 2.0]},
    ...     units={"cube.position.x": "mm"},
    ...     scene=teachtree.Scene("bodies:\\n  cube: {role: object, mass: 50 g, parts: [{box: [40 mm, 40 mm, 40 mm]}]}"),
    ...     name="three frames",
    ... )
    >>> log
    teachtree.Log('three frames')
    """

    def __init__(
        self,
        source: Any,
        *,
        binding: Binding | Path | None = None,
        scene: Scene | Path | None = None,
        units: Mapping[str, str] | None = None,
        name: str = "table",
        project: bool = True,
    ) -> None:
        at = None if binding is None else os.fspath(binding)
        if scene is None and isinstance(binding, Binding):
            scene = binding.scene
        file, text = (None, scene.text) if isinstance(scene, Scene) else (scene, None)
        if isinstance(source, (str, os.PathLike)):
            if text is not None or units:
                raise _argument("Log", "a file has its own units and scene; `units` and `Scene` are for tables and arrays", None)
            self._inner = _teachtree.Log.open(source, at, file, project)
        elif hasattr(source, "__arrow_c_stream__"):
            self._inner = _teachtree.Log.from_arrow(name, source, dict(units or {}), at, file, text)
        elif isinstance(source, Mapping):
            self._inner = _teachtree.Log.from_columns(name, list(_columns(source, units or {})), at, file, text)
        else:
            message = f"expected a path, a table with `__arrow_c_stream__` or a mapping of arrays, found {type(source).__name__}"
            is_dataset = hasattr(getattr(source, "data", None), "table")
            raise _argument("Log", message, "pass `dataset.data.table`" if is_dataset else None)

    @property
    def name(self) -> str:
        """Its path or name, as it was given."""
        return self._inner.name

    @property
    def hands(self) -> list[str]:
        """The hands that it measures, ``"left"`` first."""
        return self._inner.hands

    def read(self) -> Log:
        """Reads the rows of a file into memory, which speeds up several analyses. Returns itself."""
        self._inner.read()
        return self

    def __repr__(self) -> str:
        return f"teachtree.Log({self.name!r})"


def opened(log: Log | Any, binding: Binding | Path | None = None) -> Log:
    """Returns a log, made of its argument if necessary."""
    if isinstance(log, Log) and binding is not None:
        raise _argument("binding", "the log is open already, by its own binding", "write `Log(…, binding=…)`")
    return log if isinstance(log, Log) else Log(log, binding=binding)


def recordings(paths: Path | Sequence[Path], *, binding: Binding | Path | None = None) -> list[str]:
    """The recordings that paths stand for: those in folders and their subfolders, the episodes of ``"set#*"`` and ``"set#0..9"``.

    A folder of text tables with equal columns is a folder of recordings; with different ones it is one recording in parts.

    >>> import teachtree
    >>> teachtree.recordings("demos/robosuite/lift.hdf5#*", binding="demos/robosuite/lift_hdf5.binding.yaml")
    ['demos/robosuite/lift.hdf5#demo_1', 'demos/robosuite/lift.hdf5#demo_3']
    """
    listed = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    return [os.fspath(path) for path in _teachtree.recordings(listed, None if binding is None else os.fspath(binding))]


def _argument(place: str, message: str, help: str | None) -> ArgumentError:
    rendered = f"{place}: {message}" + (f"\n  help: {help}" if help else "")
    return ArgumentError(rendered, "argument", place, message, help)


def _columns(source: Mapping[str, Any], units: Mapping[str, str]) -> Iterator[tuple[str, str, Any]]:
    """Each column: its name, its unit, and a contiguous buffer of doubles or a list of texts."""
    unknown = sorted(set(units) - set(source))
    if unknown:
        raise _argument("units", f"there is no column `{unknown[0]}`", None)
    for title, values in source.items():
        unit = units.get(title, "")
        if not (hasattr(values, "dtype") and hasattr(values, "__array__")):
            try:
                yield from _listed(title, unit, list(values))
            except (TypeError, ValueError, OverflowError) as error:
                raise _argument(f"column {title}", f"expected numbers or texts, found another value: {error}", None) from None
            continue
        import numpy

        found = numpy.asarray(values)
        if not found.ndim:
            raise _argument(f"column {title}", "expected an array, found a single value", None)
        if found.dtype.kind in "OUTS":
            yield title, unit, ["" if value is None else str(value) for value in found.tolist()]
            continue
        if found.dtype.kind in "mM":
            since = found if found.dtype.kind == "m" else found - numpy.datetime64(0, "s")
            found = since / numpy.timedelta64(1, "s")
            unit = unit or "s"
        if found.dtype.kind not in "biuf":
            raise _argument(f"column {title}", f"expected numbers or texts, found {found.dtype}", None)
        places = numpy.ascontiguousarray(found.reshape(len(found), math.prod(found.shape[1:])).T, dtype="f8")
        for at, place in enumerate(places):
            yield title if found.ndim == 1 else f"{title}[{at}]", unit, place


def _listed(title: str, unit: str, values: list[Any]) -> Iterator[tuple[str, str, Any]]:
    """The column of a list, or the columns of a list of rows."""
    if values and all(value is None or isinstance(value, str) for value in values):
        yield title, unit, [value or "" for value in values]
        return
    if values and all(isinstance(value, (list, tuple)) for value in values):
        if len(set(map(len, values))) > 1:
            raise ValueError("rows of several lengths")
        for at, place in enumerate(zip(*values)):
            yield f"{title}[{at}]", unit, _doubles(place)
        return
    yield title, unit, _doubles(values)


def _doubles(values: Sequence[Any]) -> array[float]:
    return array("d", (float("nan") if value is None else float(value) for value in values))
