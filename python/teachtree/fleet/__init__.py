"""Very many recordings: plan shards, run them anywhere, read one set of results (docs/fleet.md).

The core knows no engine. :func:`plan` divides what is not done yet into shards, :func:`run_shard` does one of them, and any engine that can call a
function does all: ``teachtree.dask``, ``teachtree.ray``, an array of Slurm jobs (``python -m teachtree.fleet run … --shard I/N``), or :func:`run`.

Results are Parquet files named by what they were made of: recordings, rules, params, binding, version. A shard is done when its file in ``manifest``
is there, which is written last and whole. A retry, a second copy of a task or a second run therefore changes nothing.

>>> import tempfile, teachtree.fleet as fleet
>>> job = fleet.Job(binding="demos/robosuite/lift_hdf5.binding.yaml")
>>> out = tempfile.mkdtemp()
>>> fleet.run(["demos/robosuite/lift.hdf5#*"], job, out)
Ran(done=2, failed=0, skipped=0)
>>> fleet.run(["demos/robosuite/lift.hdf5#*"], job, out)
Ran(done=0, failed=0, skipped=2)
>>> fleet.read(out, job, "tasks")["task"].to_pylist()
['unknown', 'pick_and_place', 'unknown', 'pick_and_place']
"""

try:
    import fsspec as _fsspec  # noqa: F401
    import pyarrow as _pyarrow  # noqa: F401
except ModuleNotFoundError as error:
    help = "the package with the extra `fleet` brings them: pip install './python[fleet]'"
    raise ModuleNotFoundError(f"teachtree.fleet needs pyarrow and fsspec, found no {error.name}\n  help: {help}", name=error.name) from None

from ._diff import Diff, diff
from ._job import Job
from ._page import page
from ._plan import Plan, Recording, Shard, plan, recordings
from ._results import jobs, read
from ._run import Ran, run, run_shard

__all__ = ["Diff", "Job", "Plan", "Ran", "Recording", "Shard", "diff", "jobs", "page", "plan", "read", "recordings", "run", "run_shard"]
