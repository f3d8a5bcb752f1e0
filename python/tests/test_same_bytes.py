"""The package gives the bytes of the command line, over all shipped recordings."""

import subprocess
import sys
from pathlib import Path

import pytest

import teachtree

SHIPPED = [
    ("robosuite/SawyerNutAssembly_demo_1.csv", "robosuite/sawyer_nut_assembly"),
    ("robosuite/nut_assembly_panda_demo_1.csv", "robosuite/panda_nut_assembly"),
    ("robosuite/SawyerStack_demo_1.csv", "robosuite/sawyer_stack"),
    ("robosuite/stack_panda_demo_1.csv", "robosuite/panda_stack"),
    ("robosuite/SawyerLift_demo_1.csv", "robosuite/sawyer_lift"),
    ("robosuite/lift_demo_1.csv", "robosuite/panda_lift"),
    ("robosuite/SawyerPickPlace_demo_1.csv", "robosuite/sawyer_pick_place"),
    ("robosuite/door_panda_demo_1.csv", "robosuite/door"),
    ("robosuite/wipe_panda_demo_1.csv", "robosuite/wipe"),
    ("robosuite/handover_panda_panda_demo_5.csv", "robosuite/handover"),
    ("robosuite/BaxterLift_demo_1.csv", "robosuite/baxter_lift"),
    ("robosuite/BaxterPegInHole_demo_1.csv", "robosuite/baxter_peg_in_hole"),
    ("robosuite/lift.hdf5#demo_1", "robosuite/lift_hdf5"),
    ("dapg_door/door_00.csv", "bindings/dapg_door"),
    ("dapg_door/door_03.csv", "bindings/dapg_door"),
    ("dfki_hand/recording_excerpt.tsv", "bindings/dfki_hand"),
]


def program(*words: str) -> subprocess.CompletedProcess[bytes]:
    """The command line program that the wheel installs."""
    installed = Path(sys.executable).with_name("teachtree")
    return subprocess.run([installed, *words], capture_output=True, check=False, timeout=600)


def test_every_shipped_recording_is_in_the_list() -> None:
    tables = {path for ending in ("csv", "tsv", "hdf5") for path in Path("demos").rglob(f"*.{ending}")}
    listed = {Path("demos", log.split("#")[0]) for log, _ in SHIPPED}
    assert tables == listed


@pytest.mark.parametrize(("log", "binding"), SHIPPED)
def test_the_bytes_are_those_of_the_command_line(log: str, binding: str) -> None:
    log, binding = f"demos/{log}", f"demos/{binding}.binding.yaml"
    analysis = teachtree.Rules().analyze(teachtree.Log(log, binding=binding))
    for form, text in {"json": analysis.json(), "csv": analysis.csv()}.items():
        printed = program("analyze", log, "--binding", binding, "--format", form)
        assert printed.returncode == 0, printed.stderr.decode()
        assert text.encode() == printed.stdout


def test_rules_and_params_of_ones_own_give_the_same_too(tmp_path: Path) -> None:
    log, binding = "demos/robosuite/SawyerNutAssembly_demo_1.csv", "demos/robosuite/sawyer_nut_assembly.binding.yaml"
    rules = teachtree.Rules("examples/hold.rules", params={"hold_time": "200 ms"})
    analysis = rules.analyze(log, binding=binding)
    words = ("--binding", binding, "--rules", "examples/hold.rules", "--set", "hold_time=200 ms")
    assert analysis.json().encode() == program("analyze", log, *words, "--format", "json").stdout
    assert analysis.digest != teachtree.analyze(log, binding=binding).digest

    frames = tmp_path / "frames.parquet"
    program("analyze", log, *words, "--frames", str(frames), "--signals", "near,target.velocity")
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    written = parquet.read_table(frames)
    table = pyarrow.table(analysis.frames(["near", "target.velocity"]))
    assert table.column_names == written.column_names
    for name in table.column_names:
        ours = ["" if value is None else value for value in table[name].to_pylist()]
        theirs = ["" if value is None else value for value in written[name].to_pylist()]
        # Written this way, two NaN are equal.
        assert list(map(str, ours)) == [str(int(value)) if name == "row" else str(value) for value in theirs], name


def test_the_program_says_its_version_and_exits_as_it_does_alone() -> None:
    assert program("--version").stdout.decode().strip() == f"teachtree {teachtree.__version__}"
    missing = program("analyze", "no_such_log.csv")
    assert missing.returncode == 2
    assert missing.stderr.decode().startswith("error: no_such_log.csv: there is no such file")
    assert subprocess.run([sys.executable, "-m", "teachtree", "check"], check=False, capture_output=True).returncode == 0
