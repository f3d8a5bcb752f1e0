"""What is done to every recording: rules, params, binding; it travels with all its files."""

from __future__ import annotations

import atexit
import hashlib
import json
import os
import re
import shutil
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path

from .. import __version__, _teachtree
from .._analysis import Analysis
from .._errors import NotFound, RulesError
from .._log import Binding, Log
from .._rules import Rules


class Job:
    """Rules, params and a binding for all recordings, with the contents of every file that they are read from, so that it can be sent anywhere.

    ``project`` is a recording on this machine: what is not named is taken from the ``teachtree.yaml`` above it (docs/project.md). ``expect`` has the
    tasks that each recording should contain, instead of those that the binding names.

    >>> import teachtree.fleet as fleet
    >>> one = fleet.Job(rules=["examples/hold.rules"], params={"hold_time": "200 ms"})
    >>> other = fleet.Job(rules=["examples/hold.rules"])
    >>> one.digest == other.digest, len(one.digest)
    (False, 32)
    """

    def __init__(
        self,
        *,
        rules: Sequence[str | os.PathLike[str]] | str | os.PathLike[str] = (),
        params: Mapping[str, str] | None = None,
        hand: str | os.PathLike[str] | None = None,
        binding: str | os.PathLike[str] | None = None,
        scene: str | os.PathLike[str] | None = None,
        expect: str | None = None,
        project: str | os.PathLike[str] | None = None,
    ) -> None:
        if project is not None:
            of_project = _teachtree.project_settings(project, binding is not None)
            of_binding, of_scene, of_rules, of_hand, of_params, of_expect = of_project
            binding, scene = binding or of_binding, of_scene if scene is None else scene
            rules, hand = rules or of_rules, of_hand if hand is None else hand
            params = {**dict(of_params), **(params or {})}
            expect = of_expect if expect is None else expect
        named = [rules] if isinstance(rules, (str, os.PathLike)) else list(rules)
        self.rules = [os.fspath(rule) for rule in named]
        """The rule files, as they were named."""
        self.params = dict(params or {})
        """The params that are set."""
        self.hand = None if hand is None else os.fspath(hand)
        self.binding = None if binding is None else os.fspath(binding)
        self.scene = None if scene is None else os.fspath(scene)
        self.expect = expect
        """The tasks that each recording should contain; ``None`` for those that the binding names."""
        # What is wrong with the job is reported here, not by every worker.
        for given in (self.binding, self.scene):
            if given is not None and not os.path.isfile(given):
                raise NotFound(f"{given}: there is no such file", "io", given, "there is no such file")
        hand = self.hand or _hand_file(self.binding)
        try:
            read = Rules(*self.rules, params=self.params, hand=hand)._rules().own_files
        except RulesError:
            if self.rules:
                raise
            # Without files, logs of two hands have other rules, with params of their own.
            read = Rules("bimanual.rules", params=self.params, hand=hand)._rules().own_files
        candidates: tuple[str | None, ...] = (*read, *self.rules, hand, self.binding, self.scene, *_urdf_files(self.binding))
        files = {path for path in candidates if path and os.path.isfile(path)}
        root = os.path.commonpath([os.path.dirname(os.path.abspath(path)) for path in files]) if files else os.getcwd()
        self._files = {os.path.relpath(os.path.abspath(path), root): Path(path).read_bytes() for path in sorted(files)}

        def place(path: str) -> str:
            return os.path.relpath(os.path.abspath(path), root) if path in files else path

        self._named_rules = [place(rule) for rule in self.rules]
        self._single = [None if path is None else place(path) for path in (self.hand, self.binding, self.scene)]
        facts = [__version__, self._named_rules, self._single, sorted(self.params.items())]
        facts.extend([] if expect is None else [expect])
        digest = hashlib.sha256(json.dumps(facts).encode())
        for name, content in sorted(self._files.items()):
            digest.update(f"\0{name}\0{len(content)}\0".encode() + content)
        self.digest = digest.hexdigest()[:32]
        """The SHA-256 of all files, params and the version, its first 32 hexadecimal digits: the name of the results."""

    def describe(self) -> str:
        """What stands beside the results: JSON."""
        facts = {"schema": "teachtree.fleet/1", "version": __version__, "digest": self.digest, "params": self.params}
        hand, binding, scene = self._single
        named = {"rules": self._named_rules, "hand": hand, "binding": binding, "scene": scene, "expect": self.expect}
        return json.dumps({**facts, **named}, indent=1) + "\n"

    def ready(self) -> tuple[Rules, Binding | None, str | None]:
        """The rules, binding and scene on this machine: the files are written into a temporary folder, once per process."""
        return _placed(self)[1:]

    def analyze(self, log: Log) -> Analysis:
        """Analyzes a log that was opened with :meth:`ready`; the rules are loaded once per process, and once more for logs of two hands."""
        analysis = Analysis(_loaded(self, log).analyze(log._inner), log)
        return analysis if self.expect is None else analysis.expecting(self.expect)

    def named(self, text: str) -> str:
        """An error's text with the names of the files instead of where they are on this machine."""
        return text.replace(f"{_placed(self)[0]}{os.sep}", "")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Job) and other.digest == self.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        return f"<teachtree.fleet.Job {self.digest}: {', '.join(self.rules) or 'the shipped rules'}>"


_PLACING = threading.Lock()


def _placed(job: Job) -> tuple[str, Rules, Binding | None, str | None]:
    # One thread at a time: others find the same folder.
    with _PLACING:
        return _ready(job)


@lru_cache(maxsize=8)
def _ready(job: Job) -> tuple[str, Rules, Binding | None, str | None]:
    folder = tempfile.mkdtemp(prefix=f"teachtree-{job.digest}-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for name, content in job._files.items():
        path = Path(folder, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)

    def place(name: str) -> str:
        return os.path.join(folder, name) if name in job._files else name

    hand, binding, scene = (None if name is None else place(name) for name in job._single)
    rules = Rules(*map(place, job._named_rules), params=job.params, hand=hand)
    return folder, rules, None if binding is None else Binding(binding), scene


_KNOWN: dict[tuple[Job, int, str | None], _teachtree.Rules] = {}


def _loaded(job: Job, log: Log) -> _teachtree.Rules:
    """The rules of a job for a log: besides the job, they depend on its number of hands and on its hand model."""
    key = job, len(log.hands), log._inner.hand_model
    known = _KNOWN.get(key)
    if known is None:
        known = _placed(job)[1]._options.for_log(log._inner)
        if len(_KNOWN) > 16:
            _KNOWN.clear()
        _KNOWN[key] = known
    return known


def _hand_file(binding: str | None) -> str | None:
    """The hand model that a binding names: one of one's own lies beside it, others come with the program."""
    if binding is None:
        return None
    name = next(_named(binding, "hand_file"), None)
    if name is None:
        return None
    own = os.path.join(os.path.dirname(binding), name)
    return own if os.path.isfile(own) else name


def _urdf_files(binding: str | None) -> list[str]:
    """The robots that a binding names: they lie beside it."""
    return [] if binding is None else [os.path.join(os.path.dirname(binding), name) for name in _named(binding, "urdf")]


def _named(binding: str, key: str) -> Iterator[str]:
    """The files that a binding names under a key."""
    text = Path(binding).read_text(encoding="utf-8", errors="replace")
    before = r"^" if key == "hand_file" else r"[\s{,]"
    for found in re.finditer(before + key + r":[ \t]*(?:\"([^\"\n]+)\"|'([^'\n]+)'|([^\"'#\s,}]+))", text, re.MULTILINE):
        yield found[1] or found[2] or found[3]
