"""Tables, reasons, scores, and what notebooks show."""

import json
import pickle
import re
from pathlib import Path

import pytest

import teachtree

LOG = "demos/robosuite/SawyerNutAssembly_demo_1.csv"
BINDING = "demos/robosuite/sawyer_nut_assembly.binding.yaml"


@pytest.fixture(scope="module")
def analysis() -> teachtree.Analysis:
    return teachtree.analyze(LOG, binding=BINDING)


def test_tables_have_what_the_json_has(analysis: teachtree.Analysis) -> None:
    [track] = analysis.data["tracks"]
    same = ("primitive", "object", "partner", "start_row", "end_row")
    for table, key in ((analysis.segments, "relabeled"), (analysis.raw_segments, "segments")):
        assert [[row[name] for name in same] for row in table.rows()] == [[it[name] for name in same] for it in track[key]]
        assert [round(row["start_s"], 6) for row in table.rows()] == [it["start_s"] for it in track[key]]
    assert analysis.segments["was"] == [it["was"] for it in track["relabeled"]]
    assert analysis.tasks["task"] == [it["task"] for it in track["tasks"]] == ["peg_in_hole", "peg_in_hole"]
    assert analysis.tasks["secondary"] == [it["secondary"] for it in track["tasks"]]
    assert analysis.issues["kind"] == [it["kind"] for it in analysis.data["issues"]]
    of_task = [row["primitive"] for row in analysis.segments.rows() if row["task"] == 2]
    assert of_task == [it["primitive"] for it in track["tasks"][1]["segments"]]
    assert analysis.frame_count == analysis.data["log"]["frames"]


def test_an_outcome_has_what_the_json_has(analysis: teachtree.Analysis) -> None:
    outcome = analysis.outcome
    assert (outcome.result, outcome.attempts, outcome.expected, outcome.as_expected) == ("success", 1, None, None)
    found = analysis.data["outcome"]
    assert [reason.kind for reason in outcome.reasons] == [it["kind"] for it in found["reasons"]]
    assert [reason.message for reason in outcome.reasons] == [it["message"] for it in found["reasons"]]
    assert str(outcome).startswith("success: right peg_in_hole SquareNut0 (peg1) ")
    assert list(analysis.tasks["attempt"]) == [it["attempt"] for it in analysis.data["tracks"][0]["tasks"]] == [1, 1]
    assert list(analysis.tasks["failure"]) == [False, False]
    three = analysis.expecting("peg_in_hole x 3").outcome
    assert (three.result, three.expected, three.as_expected) == ("failure", "peg_in_hole x 3", False)
    assert str(three.reasons[0]) == "expected peg_in_hole x 3, found 2"
    two = analysis.expecting("peg_in_hole x 2").outcome
    assert two.as_expected is True and str(two).startswith("success: right peg_in_hole ")
    with pytest.raises(teachtree.ArgumentError, match="did you mean `peg_in_hole`"):
        analysis.expecting("peg_in_hol")


def test_tables_go_into_every_library(analysis: teachtree.Analysis) -> None:
    table = analysis.segments
    expected = table.to_dict()
    pyarrow, polars, pandas = (pytest.importorskip(name) for name in ("pyarrow", "polars", "pandas"))
    assert pyarrow.table(table).to_pydict() == expected
    assert pyarrow.schema(table).names == table.column_names
    assert table.to_pyarrow().to_pydict() == expected
    assert polars.DataFrame(table).to_dict(as_series=False) == expected
    assert table.to_polars().to_dict(as_series=False) == expected
    frame = table.to_pandas()
    assert frame["start_s"].dtype == "float64"
    assert [list(row) for row in frame["was"]] == expected["was"]
    assert len(analysis.frames(["near"]).to_pandas()) == analysis.frame_count


def test_values_per_frame_have_units_and_labels(analysis: teachtree.Analysis) -> None:
    frames = analysis.frames(["target.velocity", "near"])
    assert "right.target.velocity.x [m/s]" in frames.column_names
    labels = frames["right.label"]
    for row in analysis.segments.rows():
        assert set(labels[row["start_frame"] : row["end_frame"]]) == {row["primitive"]}
    with pytest.raises(teachtree.ArgumentError, match="found `neer`") as raised:
        analysis.frames(["neer"])
    assert raised.value.help is not None and "near" in raised.value.help


def test_reasons_are_text_and_data(analysis: teachtree.Analysis) -> None:
    grasp = next(row for row in analysis.segments.rows() if row["primitive"] == "Grasp")
    at = (grasp["start_s"] + grasp["end_s"]) / 2
    why = analysis.explain(at)
    assert why.data["explanations"][0]["leaf"] == "Grasp" and "Grasp" in str(why)
    not_press = analysis.why_not(at, "Press", track="right")
    assert not_press.data["explanations"][0]["why_not"]
    with pytest.raises(teachtree.ArgumentError):
        analysis.explain(1e9)
    with pytest.raises(teachtree.ArgumentError, match="found `middle`"):
        analysis.explain(at, track="middle")


def test_a_score_against_ones_own_result_is_perfect(analysis: teachtree.Analysis, tmp_path: Path) -> None:
    labels = tmp_path / "labels.csv"
    lines = [f"{row['start_s']},{row['end_s']},{row['primitive']}" for row in analysis.segments.rows()]
    labels.write_text("start_s,end_s,label\n" + "\n".join(lines) + "\n")
    score = analysis.score(labels, track="right")
    assert score.accuracy == pytest.approx(1.0, abs=1e-3)
    assert score.data["schema"] == "teachtree.score/1"
    assert score._repr_html_().startswith("<svg")
    worse = "\n".join(line.replace("Translate", "Grasp") for line in lines)
    labels.write_text("start_s,end_s,label\n" + worse + "\n")
    assert 0.1 < (analysis.score(labels, track="right").accuracy or 0) < 0.95
    with pytest.raises(teachtree.Error, match="has no true labels"):
        analysis.score()


def test_confidence_adds_columns(analysis: teachtree.Analysis) -> None:
    sure = analysis.with_confidence()
    assert "confidence" not in analysis.segments.column_names
    shares = sure.segments["confidence"]
    assert all(0.0 <= share < 0.9 for share in shares)
    assert "confidence" not in sure.tasks.column_names
    assert all(0.0 <= share <= 1.0 for name in ("segments", "tasks") for share in getattr(sure, name)["stability"])


def test_a_notebook_shows_a_page_that_needs_no_network(analysis: teachtree.Analysis) -> None:
    shown = analysis._repr_html_()
    assert shown.startswith("<iframe") and shown.count("<iframe") == 1
    assert not re.search(r"(?:src|href)=&quot;https?:", shown)
    tree = teachtree.Rules("examples/hold.rules")._repr_html_()
    assert tree.startswith("<svg") and "Hold" in tree
    assert analysis.segments._repr_html_().count("<tr>") > 5


def test_a_form_is_written_whole(analysis: teachtree.Analysis, tmp_path: Path) -> None:
    for name, text in {"a.json": analysis.json(), "a.csv": analysis.csv(), "a.html": analysis.html()}.items():
        analysis.save(tmp_path / name)
        assert (tmp_path / name).read_bytes() == text.encode()
    with pytest.raises(teachtree.ArgumentError, match="expected a name in"):
        analysis.save(tmp_path / "a.txt")
    assert len(list(tmp_path.iterdir())) == 3


def test_errors_are_data_and_travel_between_processes() -> None:
    with pytest.raises(teachtree.RulesError) as raised:
        teachtree.Rules(text='use "contact.rules"\nprimitive Hold Hold', name="hold.rules")
    error = raised.value
    assert error.code.startswith("E") and error.code == error.diagnostics[0].code
    assert error.diagnostics[0].file == "hold.rules" and error.diagnostics[0].start == (2, 16)
    assert error.place.startswith("hold.rules:2:16")
    assert str(error) == error.rendered and "hold.rules:2:16" in error.rendered
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.diagnostics) == (type(error), str(error), error.diagnostics)


def test_a_param_that_does_not_fit_is_said_with_the_log() -> None:
    with pytest.raises(teachtree.RulesError, match="no_such_param"):
        teachtree.Rules(params={"no_such_param": "1 N"}).analyze(LOG, binding=BINDING)
    # Of a param that the files have, at once.
    for value in ("200 N", "5 s", "None"):
        with pytest.raises(teachtree.RulesError, match="hold_time"):
            teachtree.Rules("examples/hold.rules", params={"hold_time": value})


def test_check_lists_what_the_command_line_lists() -> None:
    broken = sorted(Path("tests/fixtures/diagnostics").glob("*.rules"))[:20]
    assert broken
    for path in broken:
        for found in teachtree.check(path):
            assert re.fullmatch(r"[EW]\d+", found.code)
            assert found.severity == ("error" if found.code.startswith("E") else "warning")
            assert found.message in str(found)
    assert any(teachtree.check(path) for path in broken)


def test_what_can_be_detected_is_listed() -> None:
    [right] = teachtree.Rules().detectable(LOG, binding=BINDING)
    assert right.track == "right" and "Grasp" in right.primitives
    assert json.dumps(list(right.undetectable))
