"""Other threads run while Rust works; Ctrl-C interrupts; many recordings use all cores."""

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import teachtree

LOG = "demos/robosuite/SawyerNutAssembly_demo_1.csv"
BINDING = "demos/robosuite/sawyer_nut_assembly.binding.yaml"


def test_other_threads_run_meanwhile() -> None:
    analysis = teachtree.analyze(LOG, binding=BINDING)
    done = threading.Event()
    ticks = 0

    def tick() -> None:
        nonlocal ticks
        while not done.wait(0.001):
            ticks += 1

    thread = threading.Thread(target=tick)
    thread.start()
    before = ticks
    analysis.with_confidence()
    # If the lock were held, the other thread would stand still until the call returns.
    counted = ticks - before
    done.set()
    thread.join()
    assert counted > 0


SLOW = """
import teachtree
analysis = teachtree.analyze({log!r}, binding={binding!r})
print("begun", flush=True)
try:
    while True:
        analysis.with_confidence()
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


def test_ctrl_c_interrupts() -> None:
    script = SLOW.format(log=LOG, binding=BINDING)
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=60)
    assert out == "interrupted\n" and process.returncode == 0


def test_ctrl_c_ends_the_program_as_a_shell_expects(tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("teachtree")
    words = [program, "fit", LOG, "--binding", BINDING]
    process = subprocess.Popen([program, "analyze", "-", "--binding", BINDING], stdin=subprocess.PIPE, cwd=Path.cwd())
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 130
    assert words


def test_many_recordings_come_in_order_and_a_bad_one_is_an_outcome(tmp_path: Path) -> None:
    text = Path("demos/robosuite/lift_demo_1.csv").read_text()
    for at in range(12):
        (tmp_path / f"lift_{at:02}.csv").write_text(text if at != 5 else text.replace("\n", "\nbad", 3))
    binding = "demos/robosuite/panda_lift.binding.yaml"
    found = list(teachtree.analyze_many(tmp_path, binding=binding, jobs=3))
    assert [Path(one.path).name for one in found] == [f"lift_{at:02}.csv" for at in range(12)]
    assert [one.analysis is None for one in found] == [at == 5 for at in range(12)]
    bad = found[5].error
    assert bad is not None and "lift_05.csv" in str(bad)
    segments = [one.analysis.segments.to_dict() for one in found if one.analysis]
    assert all(one == segments[0] for one in segments)


def test_threads_share_rules() -> None:
    rules = teachtree.Rules()
    found: list[str] = []

    def work() -> None:
        found.append(rules.analyze(LOG, binding=BINDING).json())

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4 and len(set(found)) == 1


def test_a_forked_process_works() -> None:
    multiprocessing = pytest.importorskip("multiprocessing")
    if "fork" not in multiprocessing.get_all_start_methods():
        pytest.skip("no fork here")
    teachtree.analyze(LOG, binding=BINDING)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map_async(_tasks, [LOG, LOG]).get(timeout=120) == [["peg_in_hole"] * 2] * 2


def _tasks(log: str) -> list[str]:
    return list(teachtree.analyze(log, binding=BINDING).tasks["task"])
