"""Rules from labels: the bytes of the command line."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import teachtree

STATES = (("Wait", 0.0, 0), ("Hold", 0.0, 1), ("Raise", 0.08, 1))
TWO = """use "stream.rules"

stream { for each hand { gripper.closed : bool } }

for each hand {
  signal closed = gripper.closed
  signal height = mean(fingers.position).z
}

primitive Wait does free, Hold does carry

tree skills for each hand {
  not closed => Wait
  else       => Hold
}

task hold = Wait .. Wait with Hold
"""


def recording(shift: int) -> str:
    """A gripper that is open and low, closed and low, closed and high, in turns; ``shift`` varies how long each takes."""
    rows = ["time [s],right.thumb.position.x,right.thumb.position.y,right.thumb.position.z,right.gripper.closed,right.label"]
    for cycle in range(6):
        for at, (label, height, closed) in enumerate(STATES):
            for _ in range(30 + (7 * cycle + 5 * at + 11 * shift) % 23):
                row = len(rows) - 1
                rows.append(f"{row * 0.05:.2f},0,0,{height + 0.001 * ((row * 7 + shift) % 10):.4f},{closed},{label}")
    return "\n".join(rows) + "\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "scene.yaml").write_text("bodies: {cube: {role: object, radius: 60 mm}}\nhands: {right: {fingers: [thumb]}}\n")
    (tmp_path / "two.rules").write_text(TWO)
    (tmp_path / "logs").mkdir()
    for shift, name in enumerate(("ann_1", "ann_2", "bob_1", "eve_1", "kim_1")):
        (tmp_path / "logs" / f"{name}.csv").write_text(recording(shift))
        (tmp_path / "logs" / f"{name}.scene.yaml").write_text((tmp_path / "scene.yaml").read_text())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def printed(*words: str) -> dict[str, object]:
    """What the command line prints."""
    done = subprocess.run([Path(sys.executable).with_name("teachtree"), "learn", *words, "--format", "json"], capture_output=True, check=False)
    assert done.returncode in (0, 1), done.stderr.decode()
    found = json.loads(done.stdout)
    assert isinstance(found, dict)
    return found


def test_a_new_primitive_is_that_of_the_command_line(folder: Path) -> None:
    learned = teachtree.learn("logs", new="Raise", rules="two.rules")
    assert learned.data == printed("logs", "--new", "Raise", "--rules", "two.rules")
    assert learned.is_better and "primitive Raise is Hold" in str(learned)
    (folder / "mine.rules").write_text(str(learned))
    assert "Raise" in teachtree.Rules("mine.rules").primitives


def test_a_whole_file_is_that_of_the_command_line(folder: Path) -> None:
    learned = teachtree.learn(sorted(folder.glob("logs/*.csv")), group_by="^([a-z]+)", map="Raise=Lift", rules=["two.rules"])
    logs = [str(log) for log in sorted(folder.glob("logs/*.csv"))]
    words = ("--group-by", "^([a-z]+)", "--map", "Raise=Lift", "--rules", "two.rules")
    assert learned.data == printed(*logs, *words)
    assert learned.is_better and learned.data["groups"] == ["ann", "bob", "eve", "kim"]
    assert "Lift" in teachtree.Rules(text=learned.rules).primitives


def test_a_written_file_is_that_of_the_command_line(folder: Path) -> None:
    (folder / "wrong.rules").write_text(TWO.replace("not closed => Wait", "not closed or height > 60 mm => Wait"))
    learned = teachtree.learn("logs", start="wrong.rules", map="Raise=Hold", group_by="^([a-z]+)")
    assert learned.data == printed("logs", "--from", "wrong.rules", "--map", "Raise=Hold", "--group-by", "^([a-z]+)")
    assert learned.is_better and learned.data["changes"]


def test_failures_have_their_classes(folder: Path) -> None:
    (folder / "bad.rules").write_text('use "stream.rules"\nsignal a = b\n')
    (folder / "cut.csv").write_text("time [s],right.label\n0,Wait\n0,Hold\n")
    for logs, rules, kind in (("none", "two.rules", teachtree.NotFound), ("logs", "bad.rules", teachtree.RulesError), ("cut.csv", "two.rules", teachtree.LogError)):
        with pytest.raises(kind):
            teachtree.learn(logs, rules=rules)


def test_what_cannot_be_learned_from_is_an_error_with_its_place(folder: Path) -> None:
    with pytest.raises(teachtree.ArgumentError) as raised:
        teachtree.learn("logs", group_by="_", rules="two.rules")
    assert "expected at least 2, so that one can be held out" in raised.value.message
    assert raised.value.place == "the labels" and raised.value.help
