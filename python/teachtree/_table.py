"""Tables of results: they leave by the Arrow C interface, so no library of tables has to be installed."""

from __future__ import annotations

import html
from array import array
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from . import _teachtree

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow

_SHOWN = 20


class Table:
    """A table of an analysis.

    ``pyarrow.table(t)``, ``polars.DataFrame(t)``, ``duckdb``, and whatever else speaks the Arrow PyCapsule interface take it as it is;
    :meth:`to_pandas` needs pandas alone.

    >>> import teachtree
    >>> analysis = teachtree.analyze("demos/robosuite/lift_demo_1.csv", binding="demos/robosuite/panda_lift.binding.yaml")
    >>> table = analysis.tasks
    >>> len(table), table["task"]
    (1, ['pick_and_place'])
    """

    def __init__(self, inner: _teachtree.Table) -> None:
        self._inner = inner

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> Any:
        """The table as an Arrow C stream, in a capsule."""
        return self._inner.__arrow_c_stream__(requested_schema)

    def __arrow_c_schema__(self) -> Any:
        """The schema as an Arrow C schema, in a capsule."""
        return self._inner.__arrow_c_schema__()

    @property
    def column_names(self) -> list[str]:
        """The names of the columns, as in docs/formats.md."""
        return self._inner.column_names

    def __len__(self) -> int:
        return len(self._inner)

    def __getitem__(self, name: str) -> Any:
        """A column: a numpy array of numbers (``array.array`` without numpy), a list otherwise."""
        kind, values = self._inner.column(name)
        if not kind:
            return values
        try:
            import numpy
        except ImportError:
            return array(kind, values)
        return numpy.frombuffer(values, dtype="<f8" if kind == "d" else "<i8")

    def rows(self) -> Iterator[dict[str, Any]]:
        """The rows, each a dictionary of plain values."""
        names = self.column_names
        columns = [_plain(self[name]) for name in names]
        for values in zip(*columns):
            yield dict(zip(names, values))

    def to_dict(self) -> dict[str, list[Any]]:
        """Each column as a list of plain values."""
        return {name: _plain(self[name]) for name in self.column_names}

    def to_pandas(self) -> pandas.DataFrame:
        """A data frame of pandas."""
        import pandas

        return pandas.DataFrame({name: self[name] for name in self.column_names})

    def to_polars(self) -> polars.DataFrame:
        """A data frame of polars, without a copy."""
        import polars

        return polars.DataFrame(self)

    def to_pyarrow(self) -> pyarrow.Table:
        """A table of pyarrow, without a copy."""
        import pyarrow

        return pyarrow.table(self)

    def __repr__(self) -> str:
        return f"<teachtree.Table: {len(self)} rows of {', '.join(self.column_names)}>"

    def _repr_html_(self) -> str:
        """The first rows, for notebooks."""
        names = self.column_names
        head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
        body = []
        for at, row in enumerate(self.rows()):
            if at == _SHOWN:
                body.append(f"<tr><td colspan='{len(names)}'>… {len(self) - _SHOWN} more</td></tr>")
                break
            body.append("<tr>" + "".join(f"<td>{html.escape(_shown(value))}</td>" for value in row.values()) + "</tr>")
        return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(body)}</tbody></table>"


def _plain(values: Any) -> list[Any]:
    return values if isinstance(values, list) else values.tolist()


def _shown(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.3f}"
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)
