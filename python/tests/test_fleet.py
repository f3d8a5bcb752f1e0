"""A fleet: rows as those of a serial run, whatever is killed, run twice, poisoned or in an object store."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import teachtree

pytest.importorskip("pyarrow")
pytest.importorskip("fsspec")

import teachtree.fleet as fleet  # noqa: E402

BINDING = "demos/robosuite/panda_lift.binding.yaml"
# A short run; the figures of docs/measurements/fleet.md are of `TEACHTREE_RECORDINGS=2000 TEACHTREE_KILLS=20`.
RECORDINGS = int(os.environ.get("TEACHTREE_RECORDINGS", "400"))
KILLS = int(os.environ.get("TEACHTREE_KILLS", "3"))
# What two runs may have differently.
CLOCKED = ["seconds", "shard", "done_at"]


def short(folder: Path, count: int, rows: int = 40) -> Path:
    """Short recordings that differ: pieces of a shipped one."""
    lines = Path("demos/robosuite/lift_demo_1.csv").read_text().splitlines()
    folder.mkdir(parents=True, exist_ok=True)
    for at in range(count):
        first = 1 + at % (len(lines) - rows - 1)
        (folder / f"piece_{at:04}.csv").write_text("\n".join([lines[0], *lines[first : first + rows + at % 7]]) + "\n")
    return folder


@pytest.fixture(scope="module")
def job() -> fleet.Job:
    os.chdir(Path(__file__).resolve().parents[2])
    return fleet.Job(binding=BINDING)


def rows(out: Path | str, job: fleet.Job, **given: object) -> dict[str, list[object]]:
    """All rows of all tables, without clocks."""
    found = {}
    for table in ("segments", "tasks", "issues", "manifest"):
        read = fleet.read(str(out), job, table, **given)  # type: ignore[arg-type]
        found[table] = read.drop_columns([name for name in CLOCKED if name in read.column_names]).to_pylist()
    return found


def test_rows_are_those_of_single_analyses(tmp_path: Path, job: fleet.Job) -> None:
    folder = short(tmp_path / "set", 5)
    assert fleet.run([folder], job, str(tmp_path / "out"), shard_size=2) == fleet.Ran(5, 0, 0)
    expected = []
    for path in sorted(folder.iterdir()):
        expected += [{"log": str(path), **row} for row in teachtree.analyze(path, binding=BINDING).segments.rows()]
    found = fleet.read(str(tmp_path / "out"), job).drop_columns(["key"]).to_pylist()
    assert found == expected
    assert [known["digest"] for known in fleet.jobs(str(tmp_path / "out"))] == [job.digest]


def test_a_second_run_does_nothing_and_a_changed_recording_is_done_again(tmp_path: Path, job: fleet.Job) -> None:
    folder, out = short(tmp_path / "set", 6), str(tmp_path / "out")
    assert fleet.run([folder], job, out, shard_size=4) == fleet.Ran(6, 0, 0)
    files = {path: path.stat().st_mtime_ns for path in Path(out).rglob("*") if path.is_file()}
    assert fleet.run([folder], job, out, shard_size=4) == fleet.Ran(0, 0, 6)
    assert {path: path.stat().st_mtime_ns for path in Path(out).rglob("*") if path.is_file()} == files
    changed = folder / "piece_0003.csv"
    changed.write_text("\n".join(changed.read_text().splitlines()[:-3]) + "\n")
    assert fleet.run([folder], job, out) == fleet.Ran(1, 0, 5)
    # Its rows are those of what it is now.
    fleet.run([folder], job, str(tmp_path / "anew"))
    assert rows(out, job) == rows(tmp_path / "anew", job)
    # Another rule set has other results, and leaves these.
    other = fleet.Job(binding=BINDING, params={"touch_on": "0.2 N"})
    assert other.digest != job.digest
    assert fleet.run([folder], other, out) == fleet.Ran(6, 0, 0)
    assert fleet.run([folder], job, out) == fleet.Ran(0, 0, 6)


def test_a_poisoned_recording_is_a_row(tmp_path: Path, job: fleet.Job) -> None:
    folder = short(tmp_path / "set", 9)
    (folder / "piece_0004.csv").write_text("t,cube_px\n0.0,what\n")
    (folder / "piece_0007.csv").write_bytes(b"\xff\x00\xfe" * 50)
    out = str(tmp_path / "out")
    assert fleet.run([folder], job, out) == fleet.Ran(9, 2, 0)
    manifest = {Path(row["log"]).name: row for row in fleet.read(out, job, "manifest").to_pylist()}
    assert len(manifest) == 9
    assert {name for name, row in manifest.items() if row["status"] != "ok"} == {"piece_0004.csv", "piece_0007.csv"}
    assert "piece_0004.csv" in manifest["piece_0004.csv"]["error"] and manifest["piece_0004.csv"]["code"]
    assert fleet.run([folder], job, out) == fleet.Ran(0, 0, 9)


def test_a_recording_whose_name_is_not_utf_8_is_a_row(tmp_path: Path, job: fleet.Job) -> None:
    folder, out = short(tmp_path / "set", 2), str(tmp_path / "out")
    try:
        os.rename(folder / "piece_0001.csv", os.fsencode(folder) + b"/piece_\xff.csv")
    except OSError:
        pytest.skip("this file system refuses such names")
    assert fleet.run([folder], job, out) == fleet.Ran(2, 0, 0)
    assert [Path(log).name for log in fleet.read(out, job, "manifest")["log"].to_pylist()] == ["piece_0000.csv", "piece_\\udcff.csv"]


def test_files_beside_a_recording_are_part_of_it(tmp_path: Path) -> None:
    script = "import sys, teachtree._teachtree as t; sys.exit(t.command_line(['teachtree', *sys.argv[1:]]))"
    folder = tmp_path / "set"
    folder.mkdir()
    words = [sys.executable, "-c", script, "teach", "pick_and_place", "pick_and_place", "--seed", "1", "-o", str(folder / "grip.0.5N.csv")]
    subprocess.run(words, check=True, capture_output=True)
    fsspec = pytest.importorskip("fsspec")
    fsspec.filesystem("memory").put(str(folder), "/beside", recursive=True)
    job, out = fleet.Job(), str(tmp_path / "out")
    assert fleet.run([folder], job, out) == fleet.Ran(1, 0, 0)
    assert fleet.run(["memory://beside"], job, str(tmp_path / "fetched")) == fleet.Ran(1, 0, 0)
    scene = folder / "grip.0.5N.scene.yaml"
    scene.rename(folder / "grip.0.5N.csv.scene.yaml")
    assert fleet.run([folder], job, out) == fleet.Ran(1, 0, 0)


def test_a_store_that_does_not_answer_once_is_tried_again(tmp_path: Path, job: fleet.Job, monkeypatch: pytest.MonkeyPatch) -> None:
    from fsspec.implementations.memory import MemoryFileSystem

    fs = MemoryFileSystem()
    fs.put(str(short(tmp_path / "set", 1)), "/again", recursive=True)
    fetch, failures = MemoryFileSystem.get_file, [OSError("no answer")]

    def flaky(self: MemoryFileSystem, *given: object, **named: object) -> None:
        if failures:
            raise failures.pop()
        fetch(self, *given, **named)

    monkeypatch.setattr(MemoryFileSystem, "get_file", flaky)
    assert fleet.run(["memory://again"], job, str(tmp_path / "out")) == fleet.Ran(1, 0, 0)


def test_a_broken_file_of_many_recordings_in_a_store_is_a_row(tmp_path: Path) -> None:
    import fsspec

    fs = fsspec.filesystem("memory")
    fs.put("demos/robosuite/lift.hdf5", "/many/lift.hdf5")
    fs.pipe("/many/broken.hdf5", b"\x89HDF\r\n\x1a\n" + b"x" * 100)
    job = fleet.Job(binding="demos/robosuite/lift_hdf5.binding.yaml")
    assert fleet.run(["memory://many"], job, str(tmp_path / "out")) == fleet.Ran(3, 1, 0)


def test_mistakes_in_a_job_are_reported_before_any_work(tmp_path: Path, job: fleet.Job) -> None:
    for params in ({"hold_tim": "200 ms"}, {"hold_time": "200 N"}):
        with pytest.raises(teachtree.RulesError):
            fleet.Job(rules="examples/hold.rules", params=params)
    with pytest.raises(teachtree.RulesError):
        fleet.Job(binding=BINDING, params={"no_such_param": "1 N"})
    with pytest.raises(teachtree.NotFound):
        fleet.Job(binding="no_such.binding.yaml")
    with pytest.raises(FileNotFoundError):
        fleet.run([tmp_path / "no_such_folder"], job, str(tmp_path / "out"))
    with pytest.raises(teachtree.ArgumentError, match="there are no results of the job"):
        fleet.diff(str(tmp_path / "out"), job, job)
    # Results inside a folder of recordings are not recordings.
    folder = short(tmp_path / "set", 2)
    assert fleet.run([folder], job, str(folder / "out")) == fleet.Ran(2, 0, 0)
    assert fleet.run([folder], job, str(folder / "out")) == fleet.Ran(0, 0, 2)


def test_ctrl_c_ends_a_run_with_the_recording_it_is_at(tmp_path: Path, job: fleet.Job) -> None:
    folder, out = short(tmp_path / "set", 40), str(tmp_path / "out")
    begun = []

    def progress(done: int, of: int) -> None:
        begun.append(done)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fleet.run([folder], job, out, shard_size=1, progress=progress)
    assert begun == [1]
    while any(thread.name.startswith("teachtree") for thread in threading.enumerate()):
        time.sleep(0.01)
    assert len(fleet.read(out, job, "manifest")) < 40


def test_two_plans_at_once_give_every_row_once(tmp_path: Path, job: fleet.Job) -> None:
    folder, out = short(tmp_path / "set", 10), str(tmp_path / "out")
    plans = [fleet.plan([folder], job, out, shard_size=size) for size in (3, 4)]
    for plan in plans:
        for shard in plan.shards:
            fleet.run_shard(shard, job, out)
            fleet.run_shard(shard, job, out)
    fleet.run([folder], job, str(tmp_path / "serial"))
    assert rows(out, job) == rows(tmp_path / "serial", job)


def test_attempts_with_unlike_results_do_not_mix(tmp_path: Path, job: fleet.Job, monkeypatch: pytest.MonkeyPatch) -> None:
    """One attempt meets an error that passes, and commits between another one's tables and its manifest, or the other way round."""
    from teachtree.fleet import _run, _store

    folder = short(tmp_path / "set", 3)
    analyzed, written = _run._one, _store.Store.write

    def unlucky(recording: fleet.Recording, job: fleet.Job, sources: object) -> tuple[dict[str, object], dict[str, object]]:
        return {**_run._blank(recording, job), "code": "io", "error": "no answer"}, {}

    for first, second in ((analyzed, unlucky), (unlucky, analyzed)):
        out = str(tmp_path / f"out_{first is analyzed}")
        shard = fleet.plan([folder], job, out).shards[0]
        inner = [second]

        def interrupted(store: _store.Store, name: str, content: bytes, shard: fleet.Shard = shard, out: str = out, inner: list[object] = inner) -> None:
            if name.startswith("manifest/") and inner:
                monkeypatch.setattr(_run, "_one", inner.pop())
                fleet.run_shard(shard, job, out)
            written(store, name, content)

        monkeypatch.setattr(_run, "_one", first)
        monkeypatch.setattr(_store.Store, "write", interrupted)
        fleet.run_shard(shard, job, out)
        for row in fleet.read(out, job, "manifest").to_pylist():
            segments = fleet.read(out, job).to_pylist()
            assert sum(segment["log"] == row["log"] for segment in segments) == (row["segments"] or 0), row


def test_the_parts_of_an_array_are_the_whole(tmp_path: Path) -> None:
    folder, out = short(tmp_path / "set", 12), tmp_path / "out"
    words = [sys.executable, "-m", "teachtree.fleet", "run", str(folder), "--out", str(out), "--binding", BINDING]
    for part in ("1/3", "3/3", "2/3"):
        ran = subprocess.run([*words, "--shard", part], capture_output=True, text=True, check=False)
        assert ran.returncode == 0, ran.stderr
        assert "0 were done before" in ran.stdout
    job = fleet.Job(binding=BINDING)
    fleet.run([folder], job, str(tmp_path / "serial"))
    assert rows(out, job) == rows(tmp_path / "serial", job)
    refused = subprocess.run([*words, "--shard", "4/3"], capture_output=True, text=True, check=False)
    assert refused.returncode == 2 and "expected I/N" in refused.stderr


def test_a_job_travels_with_its_files(tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.mkdir()
    (own / "my.rules").write_text(Path("examples/hold.rules").read_text())
    (own / "my.binding.yaml").write_text(Path(BINDING).read_text())
    job = fleet.Job(rules=own / "my.rules", binding=own / "my.binding.yaml", params={"hold_time": "200 ms"})
    script = (
        "import pickle, sys, teachtree.fleet as fleet\n"
        "job = pickle.load(sys.stdin.buffer)\n"
        "rules, binding, scene = job.ready()\n"
        "print(rules.primitives[-1], rules.analyze(sys.argv[1], binding=binding).tasks['task'])\n"
    )
    import pickle

    sent = pickle.dumps(job)
    for name in ("my.rules", "my.binding.yaml"):
        (own / name).unlink()
    ran = subprocess.run(
        [sys.executable, "-c", script, str(Path("demos/robosuite/lift_demo_1.csv").resolve())], input=sent, cwd=tmp_path, capture_output=True, check=False
    )
    assert ran.stdout.decode().split()[0] == "Hold", ran.stderr.decode()
    with pytest.raises(teachtree.RulesError):
        (own / "my.rules").write_text("primitive Tap Tap\n")
        fleet.Job(rules=own / "my.rules")


def test_a_job_has_the_settings_of_a_project(tmp_path: Path) -> None:
    (tmp_path / "my.binding.yaml").write_text(Path(BINDING).read_text())
    (tmp_path / "my.rules").write_text(Path("examples/hold.rules").read_text())
    settings = "binding: my.binding.yaml, rules: [my.rules], params: {hold_time: 200 ms}"
    (tmp_path / "teachtree.yaml").write_text(f"logs: {{'*.csv': {{{settings}}}}}\n")
    job = fleet.Job(project=tmp_path / "a.csv")
    same = fleet.Job(rules=tmp_path / "my.rules", binding=tmp_path / "my.binding.yaml", params={"hold_time": "200 ms"})
    assert job == same
    other = fleet.Job(project=tmp_path / "a.csv", params={"hold_time": "300 ms"})
    assert other.params == {"hold_time": "300 ms"} and other.binding == job.binding
    own = fleet.Job(project=tmp_path / "a.csv", binding=BINDING)
    assert own.params == {} and own.rules == job.rules
    (tmp_path / "teachtree.yaml").write_text(f"logs: {{'*.csv': {{{settings}, expect: hold}}}}\n")
    expecting = fleet.Job(project=tmp_path / "a.csv")
    assert expecting.expect == "hold" and expecting.digest != job.digest
    assert expecting == fleet.Job(project=tmp_path / "b.csv", expect="hold") != fleet.Job(project=tmp_path / "b.csv", expect="hold x 2")
    with pytest.raises(teachtree.LogError, match="teachtree.yaml:1:"):
        (tmp_path / "teachtree.yaml").write_text("logs: [a]\n")
        fleet.Job(project=tmp_path / "a.csv")


def test_the_name_of_a_job_does_not_depend_on_where_it_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Here a folder `rules` has files of the names that shipped files have."""
    here = fleet.Job(rules="examples/hold.rules")
    monkeypatch.chdir("examples")
    assert fleet.Job(rules="hold.rules").digest == here.digest
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/hold.rules").write_text(Path("hold.rules").read_text())
    monkeypatch.chdir(tmp_path)
    assert fleet.Job(rules="elsewhere/hold.rules").digest == here.digest


def test_the_robots_of_a_binding_travel_with_a_job(tmp_path: Path) -> None:
    """A changed robot has other results."""
    binding = tmp_path / "b.yaml"
    binding.write_text("channels: {right.palm.position: {link: arm.hand}}\nrobots:\n  arm: {urdf: arm.urdf, joints: {a: q}}\n")
    (tmp_path / "arm.urdf").write_text("<robot/>")
    one = fleet.Job(binding=binding)
    assert sorted(one._files) == ["arm.urdf", "b.yaml"]
    (tmp_path / "arm.urdf").write_text("<robot name='other'/>")
    assert fleet.Job(binding=binding).digest != one.digest


def test_two_jobs_are_compared(tmp_path: Path) -> None:
    folder, out = short(tmp_path / "set", 8, rows=200), str(tmp_path / "out")
    far = {"near_on": "150 mm", "near_off": "200 mm"}
    one, other = fleet.Job(binding=BINDING), fleet.Job(binding=BINDING, params=far)
    for job in (one, other):
        fleet.run([folder], job, out)
    same = fleet.diff(out, one, one.digest)
    assert same.table.num_rows == 0 and str(same) == "0 of 8 recordings differ"
    found = fleet.diff(out, one, other)
    assert found.recordings == 8 and found.table.num_rows > 0
    # Labels of every instant, one by one, differ where the table says so and nowhere else.
    log = found.by_recording()[0][0]
    rules = (teachtree.Rules(), teachtree.Rules(params=far))
    labels = [of.analyze(log, binding=BINDING).segments.to_dict() for of in rules]

    def at(spans: dict[str, list], time: float) -> str | None:
        of = zip(spans["start_s"], spans["end_s"], spans["primitive"])
        return next((name for start, end, name in of if start <= time < end), None)

    intervals = [row for row in found.table.to_pylist() if row["log"] == log]
    start, end = labels[0]["start_s"][0], labels[0]["end_s"][-1]
    for step in range(1000):
        time = start + (end - start) * (step + 0.5) / 1000
        inside = [(row["a"], row["b"]) for row in intervals if row["start_s"] <= time < row["end_s"]]
        pair = (at(labels[0], time), at(labels[1], time))
        assert inside == ([pair] if pair[0] != pair[1] else []), time
    assert sum(row["seconds"] for row in found.summary()) == pytest.approx(sum(of for _, of in found.by_recording()))


def test_a_page_names_what_to_look_at(tmp_path: Path, job: fleet.Job) -> None:
    folder, out = short(tmp_path / "set", 30), str(tmp_path / "out")
    (folder / "piece_0004.csv").write_text("t,cube_px\n0.0,what\n")
    whole = folder / "whole.csv"
    whole.write_text(Path("demos/robosuite/lift_demo_1.csv").read_text())
    fleet.run([folder], job, out)
    named = fleet.page(out, job, tmp_path / "page", reports=2)
    text = (tmp_path / "page" / "index.html").read_text()
    assert str(whole) in named and "piece_0004.csv" in text
    assert "http" not in text.replace("https://www.w3.org", "")
    assert text.count('<a href="report_') == 2 and len(list((tmp_path / "page").glob("report_*.html"))) == 2


@pytest.mark.slow
def test_a_worker_killed_at_any_time_changes_no_row(tmp_path: Path, job: fleet.Job) -> None:
    distributed = pytest.importorskip("distributed")
    import teachtree.dask

    folder = short(tmp_path / "set", RECORDINGS)
    (folder / "piece_0123.csv").write_text("t,cube_px\n0.0,what\n")
    begun = time.monotonic()
    serial = tmp_path / "serial"
    assert fleet.run([folder], job, str(serial)) == fleet.Ran(RECORDINGS, 1, 0)
    lasts = time.monotonic() - begun
    expected = rows(serial, job)
    assert len(expected["manifest"]) == RECORDINGS
    seed = random.SystemRandom().randrange(1 << 32)
    chance = random.Random(seed)
    killed = 0
    for turn in range(KILLS):
        out = tmp_path / f"out_{turn}"
        cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
        with cluster, distributed.Client(cluster) as client:
            workers = list(client.run(os.getpid).values())
            stop = threading.Event()

            def kill(after: float = chance.uniform(0.0, 0.5 * lasts), pid: int = chance.choice(workers)) -> None:
                nonlocal killed
                with contextlib.suppress(ProcessLookupError):
                    if not stop.wait(after):
                        os.kill(pid, signal.SIGKILL)
                        killed += 1

            killer = threading.Thread(target=kill)
            killer.start()
            ran = teachtree.dask.run([folder], job, str(out), client=client, shard_size=50)
            stop.set()
            killer.join()
            assert ran == fleet.Ran(RECORDINGS, 1, 0), f"seed {seed}, turn {turn}"
            assert rows(out, job) == expected, f"seed {seed}, turn {turn}"
            assert teachtree.dask.run([folder], job, str(out), client=client) == fleet.Ran(0, 0, RECORDINGS)
    # Some kills may come after the work; most must not.
    assert killed > KILLS // 2


@pytest.mark.parametrize("shard_size", [6, 1])
def test_a_recording_that_ends_its_workers_is_a_row(tmp_path: Path, job: fleet.Job, shard_size: int) -> None:
    distributed = pytest.importorskip("distributed")
    import teachtree.dask

    folder, out = short(tmp_path / "set", 6), str(tmp_path / "out")
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        client.run(_deadly)
        client.register_plugin(_Deadly())
        ran = teachtree.dask.run([folder], job, out, client=client, shard_size=shard_size)
    assert ran == fleet.Ran(6, 1, 0)
    manifest = fleet.read(out, job, "manifest").to_pylist()
    assert [Path(row["log"]).name for row in manifest if row["code"] == "killed"] == ["piece_0002.csv"]


def test_a_cluster_that_lost_its_workers_ends_the_run(tmp_path: Path, job: fleet.Job) -> None:
    distributed = pytest.importorskip("distributed")
    import teachtree.dask

    folder = short(tmp_path / "set", 6)
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        client.run(_busy)
        lost = threading.Timer(7.0, cluster.scale, (0,))
        lost.start()
        with pytest.raises(RuntimeError, match="no worker for"):
            teachtree.dask.run([folder], job, str(tmp_path / "out"), client=client, patience=1.0, shard_size=1)
        lost.join()


def _busy() -> None:
    """Lets a worker never end a recording."""
    fleet.Job.analyze = lambda self, log: time.sleep(3600)  # type: ignore[assignment,method-assign,misc,return-value]


def _deadly() -> None:
    """Lets a worker die of one recording, as if the system took its memory."""
    analyze = fleet.Job.analyze

    def dying(self: fleet.Job, log: teachtree.Log) -> teachtree.Analysis:
        if log.name.endswith("piece_0002.csv"):
            # Dask does not start a worker again that ends before its start is complete.
            time.sleep(2.0)
            os.kill(os.getpid(), signal.SIGKILL)
        return analyze(self, log)

    fleet.Job.analyze = dying  # type: ignore[method-assign]


try:
    from distributed import WorkerPlugin
except ImportError:
    _Deadly = object
else:

    class _Deadly(WorkerPlugin):  # type: ignore[no-redef]
        """The same for workers that are started anew."""

        def setup(self, worker: object) -> None:
            _deadly()


@pytest.fixture(scope="module")
def s3() -> Iterator[dict[str, object]]:
    pytest.importorskip("s3fs")
    moto = pytest.importorskip("moto.server")
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    yield {"key": "key", "secret": "secret", "endpoint_url": f"http://{host}:{port}"}
    server.stop()


def test_an_object_store_is_source_and_destination(tmp_path: Path, job: fleet.Job, s3: dict[str, object]) -> None:
    import fsspec

    fs = fsspec.filesystem("s3", **s3)
    fs.mkdir("logs")
    fs.mkdir("results")
    folder = short(tmp_path / "set", 20)
    (folder / "piece_0011.csv").write_text("t,cube_px\n0.0,what\n")
    fs.put(f"{folder}/", "logs/set/", recursive=True)
    fs.put("demos/robosuite/lift.hdf5", "logs/lift.hdf5")
    out = "s3://results/fleet"
    assert fleet.run(["s3://logs/set"], job, out, shard_size=8, options=s3) == fleet.Ran(20, 1, 0)
    assert fleet.run(["s3://logs/set"], job, out, options=s3) == fleet.Ran(0, 0, 20)
    fleet.run([folder], job, str(tmp_path / "out"))
    there, here = rows(out, job, options=s3), rows(tmp_path / "out", job)
    for table, expected in here.items():
        for ours, theirs in zip(there[table], expected, strict=True):
            assert ours.pop("log") == theirs.pop("log").replace(str(folder), "s3://logs/set")
            ours.pop("key"), theirs.pop("key")
            if ours.get("error"):
                ours["error"] = ours["error"].replace("s3://logs/set", str(folder))
            assert ours == theirs
    # An object that changes is another recording.
    fs.pipe_file("logs/set/piece_0000.csv", (folder / "piece_0001.csv").read_bytes())
    assert fleet.run(["s3://logs/set"], job, out, options=s3) == fleet.Ran(1, 0, 19)

    of_file = fleet.Job(binding="demos/robosuite/lift_hdf5.binding.yaml")
    assert fleet.run(["s3://logs/lift.hdf5"], of_file, out, options=s3) == fleet.Ran(2, 0, 0)
    logs = fleet.read(out, of_file, "manifest", options=s3)["log"].to_pylist()
    assert logs == ["s3://logs/lift.hdf5#demo_1", "s3://logs/lift.hdf5#demo_3"]


def test_a_lerobot_set_in_an_object_store_is_its_episodes(tmp_path: Path, s3: dict[str, object]) -> None:
    import fsspec

    fs = fsspec.filesystem("s3", **s3)
    fs.mkdir("sets")
    fs.put("tests/fixtures/formats/lerobot_v30/", "sets/hub/lerobot_v30/", recursive=True)
    job = fleet.Job(binding="tests/fixtures/formats/lerobot_v30.binding.yaml")
    local = fleet.run(["tests/fixtures/formats/lerobot_v30#*"], job, str(tmp_path / "out"))
    assert local.done > 1
    ran = fleet.run(["s3://sets/hub"], job, "s3://sets/results", options=s3)
    assert ran == fleet.Ran(local.done, local.failed, 0)
    assert fleet.run(["s3://sets/hub/lerobot_v30#0..1"], job, "s3://sets/results", options=s3) == fleet.Ran(0, 0, 2)
    here = fleet.read(str(tmp_path / "out"), job).drop_columns(["log", "key"])
    there = fleet.read("s3://sets/results", job, options=s3).drop_columns(["log", "key"])
    assert here.equals(there)
