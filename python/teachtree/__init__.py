"""teachtree: rules that turn a recorded demonstration into named primitives and tasks.

>>> import teachtree
>>> analysis = teachtree.analyze("demos/robosuite/lift_demo_1.csv", binding="demos/robosuite/panda_lift.binding.yaml")
>>> analysis.segments["primitive"][:3]
['Move', 'Approach', 'Grasp']

:class:`Log` opens recordings, :class:`Rules` loads rules, :class:`Analysis` has tables, reasons and reports, :func:`analyze_many` works on many
recordings, :func:`learn` makes rules from labels, :class:`Live` works on a log while it is being made, ``teachtree.fleet`` on more than one machine
holds. docs/python.md goes through all of it.
"""

from ._analysis import Analysis, Explanation, OutcomeReason, RecordingOutcome, Score
from ._errors import ArgumentError, Diagnostic, Error, LogError, NotFound, RulesError
from ._learn import Learned, learn
from ._live import Calibration, Event, Live
from ._log import Binding, Log, Scene, recordings
from ._many import Outcome, analyze, analyze_many
from ._rules import Detectable, Rules, check
from ._table import Table
from ._teachtree import __version__

__all__ = [
    "Analysis",
    "ArgumentError",
    "Binding",
    "Calibration",
    "Detectable",
    "Diagnostic",
    "Error",
    "Event",
    "Explanation",
    "Learned",
    "Live",
    "Log",
    "LogError",
    "NotFound",
    "Outcome",
    "OutcomeReason",
    "RecordingOutcome",
    "Rules",
    "RulesError",
    "Scene",
    "Score",
    "Table",
    "__version__",
    "analyze",
    "analyze_many",
    "check",
    "learn",
    "recordings",
]

# People meet these names here: in errors, in pickles, in help.
for _name in __all__:
    if isinstance(globals()[_name], type):
        globals()[_name].__module__ = __name__
del _name
