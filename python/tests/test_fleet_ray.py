"""A fleet on Ray whose machines are killed: `pip install 'ray[data]'`, then `pytest python/tests/test_fleet_ray.py -s`; skipped without Ray."""

from __future__ import annotations

import os
import random
import threading
import time
from pathlib import Path

import pytest

ray = pytest.importorskip("ray")
pytest.importorskip("fsspec")

import teachtree.fleet as fleet  # noqa: E402
import teachtree.ray  # noqa: E402
from ray.cluster_utils import Cluster  # noqa: E402

from test_fleet import BINDING, RECORDINGS, rows, short  # noqa: E402

KILLS = 3


@pytest.mark.slow
def test_a_machine_killed_at_any_time_changes_no_row(tmp_path: Path) -> None:
    os.chdir(Path(__file__).resolve().parents[2])
    job = fleet.Job(binding=BINDING)
    folder = short(tmp_path / "set", RECORDINGS)
    (folder / "piece_0123.csv").write_text("t,cube_px\n0.0,what\n")
    serial = tmp_path / "serial"
    begun = time.monotonic()
    assert fleet.run([folder], job, str(serial)) == fleet.Ran(RECORDINGS, 1, 0)
    lasts = time.monotonic() - begun
    expected = rows(serial, job)
    seed = random.SystemRandom().randrange(1 << 32)
    chance = random.Random(seed)
    during = 0
    for turn in range(KILLS):
        out = tmp_path / f"out_{turn}"
        # The head has no worker; each of the two others is a machine of its own to Ray, with a process that schedules its workers.
        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "object_store_memory": 100 << 20})
        machines = [cluster.add_node(num_cpus=1, object_store_memory=100 << 20) for _ in range(2)]
        ray.init(address=cluster.address, log_to_driver=False)
        try:
            cluster.wait_for_nodes()
            ended = threading.Event()

            def kill(after: float = chance.uniform(0.2, 1.0) * lasts, victim: object = chance.choice(machines)) -> None:
                nonlocal during
                if not ended.wait(after):
                    during += 1
                    cluster.remove_node(victim, allow_graceful=False)

            killer = threading.Thread(target=kill)
            killer.start()
            ran = teachtree.ray.run([folder], job, str(out), shard_size=50)
            ended.set()
            killer.join()
            assert ran == fleet.Ran(RECORDINGS, 1, 0), f"seed {seed}, turn {turn}"
            assert rows(out, job) == expected, f"seed {seed}, turn {turn}"
            assert teachtree.ray.run([folder], job, str(out)) == fleet.Ran(0, 0, RECORDINGS)
        finally:
            ray.shutdown()
            cluster.shutdown()
    print(f"{KILLS} runs on two machines, one killed while the run went on in {during} of them: the rows are those of a serial run, each once")
    assert during > 0
