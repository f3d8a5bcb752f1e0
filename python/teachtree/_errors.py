"""Errors as exceptions, and diagnostics of rule files as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Diagnostic:
    """An error or a warning about rule files. ``str()`` draws it with the lines that it is about.

    >>> import teachtree
    >>> [found] = teachtree.check(text='use "contact.rules"\\nparam touch_on = 1 N')
    >>> found.code, found.severity, found.file, found.start
    ('E202', 'error', 'rules', (2, 7))
    """

    code: str
    """Such as ``E201``; docs/reference/codes.md explains each."""
    severity: str
    """``"error"`` or ``"warning"``."""
    message: str
    """One line, the author's words in backticks."""
    file: str | None
    """The file as it was named, or ``rules/contact.rules`` for a shipped one."""
    start: tuple[int, int] | None
    """Line and column of the first character, both from 1."""
    end: tuple[int, int] | None
    """Line and column behind the last character."""
    notes: tuple[str, ...]
    """Notes: the reasons."""
    help: tuple[str, ...]
    """Advice."""
    rendered: str
    """The text that the command line prints."""

    def __str__(self) -> str:
        return self.rendered


class Error(Exception):
    """The error of a call. ``str()`` gives the whole text: place, message and advice.

    >>> import teachtree
    >>> try:
    ...     teachtree.Log("no_such_log.csv")
    ... except teachtree.Error as error:
    ...     print(error.kind, error.place, error.message, sep=" | ")
    io | no_such_log.csv | there is no such file
    """

    def __init__(
        self,
        rendered: str,
        kind: str = "internal",
        place: str = "",
        message: str = "",
        help: str | None = None,
        diagnostics: tuple[Diagnostic, ...] = (),
    ) -> None:
        super().__init__(rendered)
        self.kind = kind
        """``io``, ``format``, ``binding``, ``scene``, ``rules``, ``mismatch``, ``argument`` or ``internal`` (docs/embedding.md)."""
        self.place = place
        """The place: ``demo.csv row 12 column right.thumb.force.x``, ``tap.rules:12:5``."""
        self.message = message or rendered
        """The expected and the found value."""
        self.help = help
        """Advice, or ``None``."""
        self.diagnostics = diagnostics
        """Each mistake in rule files; empty for other errors."""
        self.rendered = rendered
        """The whole text, as the command line prints it."""

    @property
    def code(self) -> str:
        """The code of the first diagnostic, such as ``E201``; the kind for other errors."""
        return self.diagnostics[0].code if self.diagnostics else self.kind

    def __reduce__(self) -> tuple[Any, ...]:
        # An error travels between the processes of a fleet with all that it knows.
        return type(self), (self.rendered, self.kind, self.place, self.message, self.help, self.diagnostics)


class RulesError(Error, ValueError):
    """Rule files have mistakes: see :attr:`Error.diagnostics`."""


class LogError(Error, ValueError):
    """A log, its binding or its scene cannot be used, or does not fit the rules."""


class NotFound(Error, OSError):
    """A file or folder cannot be opened, read or written."""


class ArgumentError(Error, ValueError):
    """A question without an answer: a time outside the log, an unknown track, primitive or signal."""


_KINDS: dict[str, type[Error]] = {
    "rules": RulesError,
    "format": LogError,
    "binding": LogError,
    "scene": LogError,
    "mismatch": LogError,
    "io": NotFound,
    "argument": ArgumentError,
}


def diagnostic(fields: dict[str, Any]) -> Diagnostic:
    """Makes a diagnostic from the data of the extension."""
    return Diagnostic(**{**fields, "notes": tuple(fields["notes"]), "help": tuple(fields["help"])})


def build(kind: str, place: str, message: str, help: str | None, rendered: str, found: list[dict[str, Any]]) -> Error:
    """Makes the exception of an error of the extension."""
    return _KINDS.get(kind, Error)(rendered, kind, place, message, help, tuple(map(diagnostic, found)))
