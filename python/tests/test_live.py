"""A log that is being made: its final events are what the analysis of the whole log finds."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from array import array
from pathlib import Path
from typing import Any

import pytest

import teachtree


@pytest.fixture(scope="module")
def demonstration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "demonstration.csv"
    words = ["teach", "pick_and_place", "pick_and_place", "-o", str(path)]
    subprocess.run([sys.executable, "-m", "teachtree", *words], check=True, capture_output=True)
    return path


def rows(path: Path) -> tuple[list[str], list[array[float]]]:
    with path.open(newline="") as file:
        titles, *lines = csv.reader(file)
    known = [at for at, title in enumerate(titles) if not title.endswith((".label", ".task"))]
    return [titles[at] for at in known], [array("d", (float(line[at] or "nan") for at in known)) for line in lines]


def times(found: list[dict[str, Any]]) -> list[tuple[Any, ...]]:
    return [(one["track"], one["primitive"], round(one["start_s"], 6), round(one["end_s"], 6)) for one in found]


def plain(text: str) -> Any:
    """A calibration file as plain data, with twelve digits a number: reading it may change the last."""
    return json.loads(text, parse_float=lambda number: float(f"{float(number):.12g}"))


def test_final_events_are_the_analysis(demonstration: Path) -> None:
    log = teachtree.Log(demonstration)
    columns, lines = rows(demonstration)
    scene = demonstration.with_suffix(".scene.yaml")
    live = teachtree.Live(teachtree.Calibration(teachtree.Rules(), log, whole=True), columns, scene=scene)
    events = [event for line in lines for event in live.push(line)] + live.finish()
    assert [event.sequence for event in events] == list(range(len(events)))
    final = [event.data for event in events if event.name == "segment" and event.final]
    assert times(final) == times(teachtree.Rules().analyze(log).segments.rows())
    tasks = [event.data["task"] for event in events if event.name == "task" and event.final]
    assert tasks == ["pick_and_place"]
    with pytest.raises(RuntimeError, match="has ended"):
        live.push(lines[0])


def test_labels_have_their_confidence_when_asked(demonstration: Path) -> None:
    columns, lines = rows(demonstration)
    calibration = teachtree.Calibration(teachtree.Rules(), teachtree.Log(demonstration))
    scene = demonstration.with_suffix(".scene.yaml")
    both = [teachtree.Live(calibration, columns, scene=scene, confidence=confidence) for confidence in (False, True)]
    plain, sure = ([event for line in lines[:1500] for event in live.push(line) if event.name == "label"] for live in both)
    assert {event.confidence for event in plain} == {None}
    assert [event.confidence for event in sure][:3] == [0.59, 0.74, 0.88]


def test_a_list_is_a_row_too(demonstration: Path) -> None:
    columns, lines = rows(demonstration)
    calibration = teachtree.Calibration(teachtree.Rules(), teachtree.Log(demonstration))
    scene = demonstration.with_suffix(".scene.yaml")
    both = [teachtree.Live(calibration, columns, scene=scene) for _ in range(2)]
    for line in lines[:1500]:
        assert both[0].push(line) == both[1].push(list(line))


def test_a_calibration_is_kept_in_a_file(demonstration: Path, tmp_path: Path) -> None:
    rules = teachtree.Rules()
    calibration = teachtree.Calibration(rules, teachtree.Log(demonstration))
    file = tmp_path / "calibration.yaml"
    file.write_text(calibration.text())
    assert plain(teachtree.Calibration.read(file, rules).text()) == plain(calibration.text())
    assert calibration.rate_hz == pytest.approx(1000.0)


def test_a_row_of_another_length_is_refused(demonstration: Path) -> None:
    columns, lines = rows(demonstration)
    calibration = teachtree.Calibration(teachtree.Rules(), teachtree.Log(demonstration))
    live = teachtree.Live(calibration, columns, scene=demonstration.with_suffix(".scene.yaml"))
    with pytest.raises(teachtree.Error):
        live.push([0.0])


def test_a_column_that_is_there_twice_is_refused(demonstration: Path) -> None:
    columns, _ = rows(demonstration)
    calibration = teachtree.Calibration(teachtree.Rules(), teachtree.Log(demonstration))
    with pytest.raises(teachtree.Error, match="column time: the column occurs twice"):
        teachtree.Live(calibration, [columns[0].split(" ")[0], *columns, columns[0].split(" ")[0]], scene=demonstration.with_suffix(".scene.yaml"))
    with pytest.raises(teachtree.Error, match="the column occurs twice"):
        teachtree.Live(calibration, [*columns, columns[5]], scene=demonstration.with_suffix(".scene.yaml"))
