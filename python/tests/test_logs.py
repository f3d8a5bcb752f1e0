"""Logs of files, arrays and tables: the same recording gives the same analysis, however it comes in."""

import csv
import json
import resource
from pathlib import Path

import pytest

import teachtree

LOG = "demos/robosuite/lift_demo_1.csv"
BINDING = "demos/robosuite/panda_lift.binding.yaml"


def columns() -> dict[str, list[float]]:
    with open(LOG, newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) if row[name] else float("nan") for row in rows] for name in rows[0]}


def named(data: dict[str, object]) -> dict[str, object]:
    """An analysis without the name of its log."""
    return {key: value for key, value in data.items() if key != "log"}


@pytest.fixture(scope="module")
def of_file() -> dict[str, object]:
    return named(teachtree.analyze(LOG, binding=BINDING).data)


def test_a_dictionary_of_lists_is_the_file(of_file: dict[str, object]) -> None:
    log = teachtree.Log(columns(), binding=BINDING, name="lift")
    assert named(teachtree.analyze(log).data) == of_file
    assert teachtree.analyze(log).data["log"]["path"] == "lift"


def test_numpy_arrays_of_any_kind_are_the_file(of_file: dict[str, object]) -> None:
    numpy = pytest.importorskip("numpy")
    arrays = {name: numpy.array(values) for name, values in columns().items()}
    assert named(teachtree.analyze(teachtree.Log(arrays, binding=BINDING)).data) == of_file
    # Every other value of an array twice as long: not contiguous.
    strided = {name: numpy.repeat(values, 2)[::2] for name, values in arrays.items()}
    assert named(teachtree.analyze(teachtree.Log(strided, binding=BINDING)).data) == of_file


@pytest.mark.parametrize("library", ["pyarrow", "polars", "pandas"])
def test_tables_of_every_library_are_the_file(library: str, of_file: dict[str, object]) -> None:
    module = pytest.importorskip(library)
    pytest.importorskip("pyarrow")
    table = module.table(columns()) if library == "pyarrow" else module.DataFrame(columns())
    if not hasattr(table, "__arrow_c_stream__"):
        pytest.skip(f"{library} {module.__version__} does not speak Arrow")
    assert named(teachtree.analyze(teachtree.Log(table, binding=BINDING)).data) == of_file


def test_a_table_in_batches_with_every_type_of_arrow_is_read() -> None:
    pyarrow = pytest.importorskip("pyarrow")
    numpy = pytest.importorskip("numpy")
    rows = 300
    time = numpy.arange(rows) / 100
    near = 0.2 * numpy.exp(-time)
    scene = teachtree.Scene("bodies:\n  cube: {role: object, mass: 50 g, parts: [{box: [40 mm, 40 mm, 40 mm]}]}")
    plain = {"time": time, "cube.position.x": near, "cube.position.y": numpy.round(near * 1000), "cube.position.z": time * 0}
    expected = named(teachtree.analyze(teachtree.Log(plain, scene=scene, units={"cube.position.y": "mm"})).data)
    typed = {
        "time": pyarrow.array((time * 1000).round().astype("i8"), pyarrow.duration("ms")),
        "cube.position.x": pyarrow.array(near),
        "cube.position.y": pyarrow.array(numpy.round(near * 1000).astype("i4")),
        "cube.position.z": pyarrow.array(["0.0"] * rows).dictionary_encode().cast(pyarrow.string()).cast(pyarrow.float32()),
        "camera": pyarrow.array([{"bytes": b"", "path": "a"}] * rows),
    }
    table = pyarrow.Table.from_batches(pyarrow.table(typed).to_batches(max_chunksize=7))
    read = teachtree.Log(table, scene=scene, units={"cube.position.y": "mm"})
    assert named(teachtree.analyze(read).data) == expected


def test_lists_are_a_column_for_each_place(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    numpy = pytest.importorskip("numpy")
    data = columns()
    own = tmp_path / "state.binding.yaml"
    own.write_text(Path(BINDING).read_text().replace(": R_opening", ": state[1]"))
    opening = data.pop("R_opening")
    matrix = numpy.array([[0.0] * len(opening), opening]).T
    lists = pyarrow.array(matrix.tolist(), pyarrow.list_(pyarrow.float32()))
    fixed = pyarrow.array(matrix.tolist(), pyarrow.list_(pyarrow.float64(), 2))
    expected = teachtree.analyze(LOG, binding=BINDING).segments.to_dict()
    for state in (lists, fixed):
        table = pyarrow.table({**data, "state": state})
        assert teachtree.analyze(teachtree.Log(table, binding=own)).segments.to_dict() == expected
    assert teachtree.analyze(teachtree.Log({**data, "state": matrix}, binding=own)).segments.to_dict() == expected


@pytest.mark.parametrize(
    ("source", "units", "message"),
    [
        ({"time": [0.0, 1.0], "cube.position.x": [0.0]}, {}, "expected 2 values as in the columns before, found 1"),
        ({"time": [0.0, 0.0], "cube.position.x": [0.0, 1.0]}, {}, "time"),
        ({"time": [0.0, 1.0]}, {"cube.position.x": "mm"}, "there is no column `cube.position.x`"),
        ({"time": [0.0, 1.0], "cube.position.x": [0.0, 1.0]}, {"cube.position.x": "N"}, "N"),
        ({"cube.position.x": [0.0, 1.0]}, {}, "time"),
        ({"time": [0.0, 1.0], "cube.position.x": ["here", 1.0]}, {}, "column cube.position.x: expected numbers or texts"),
        ({"time": [0.0, 1.0], "cube.position.x": 1.0}, {}, "column cube.position.x: expected numbers or texts"),
        ({"time": [0.0, 1.0], "cube.position.x": [10**400, 1.0]}, {}, "column cube.position.x: expected numbers or texts"),
        ({"time": [0.0, 1.0], "state": [[1.0], [1.0, 2.0]]}, {}, "column state: expected numbers or texts"),
        (42, {}, "expected a path, a table with `__arrow_c_stream__` or a mapping of arrays, found int"),
    ],
)
def test_what_cannot_be_a_log_is_one_clear_error(source: object, units: dict[str, str], message: str) -> None:
    with pytest.raises(teachtree.Error) as raised:
        teachtree.analyze(teachtree.Log(source, units=units))
    assert message in str(raised.value)
    assert raised.value.kind in {"format", "argument", "mismatch"}
    assert "panicked" not in str(raised.value)


def test_arrays_without_rows_and_single_values_are_refused() -> None:
    numpy = pytest.importorskip("numpy")
    with pytest.raises(teachtree.LogError, match="no rows"):
        teachtree.analyze({"time": numpy.zeros(0), "cube.position.x": numpy.zeros(0)})
    with pytest.raises(teachtree.ArgumentError, match="column time: expected an array, found a single value"):
        teachtree.Log({"time": numpy.array(0.0)})


def test_times_of_numpy_are_seconds_in_every_year() -> None:
    numpy = pytest.importorskip("numpy")
    scene = teachtree.Scene("bodies: {cube: {role: object, radius: 20 mm}}")
    place = {f"cube.position.{axis}": numpy.zeros(300) for axis in "xyz"}
    for year in ("0001", "1970", "2026", "3000"):
        time = numpy.datetime64(year) + (numpy.arange(300) * 10).astype("m8[ms]")
        expected = float((time[0] - numpy.datetime64(0, "s")) / numpy.timedelta64(1, "s"))
        found = teachtree.analyze(teachtree.Log({"time": time, **place}, scene=scene))
        # Times of these years count from the first row.
        origin = json.loads(found.json())["log"]["zero_stamp_s"]
        assert origin + found.start_s == expected and found.rate_hz == pytest.approx(100)
    time[4] = numpy.datetime64("NaT")
    with pytest.raises(teachtree.LogError, match="row 5 column time"):
        teachtree.Log({"time": time, **place}, scene=scene).read()


def test_a_log_that_is_open_has_its_binding() -> None:
    with pytest.raises(teachtree.ArgumentError, match="the log is open already"):
        teachtree.analyze(teachtree.Log(columns(), binding=BINDING), binding=BINDING)


def test_lists_that_change_their_length_are_refused() -> None:
    pyarrow = pytest.importorskip("pyarrow")
    table = pyarrow.table({"time": [0.0, 1.0], "state": [[1.0, 2.0], [1.0]]})
    with pytest.raises(teachtree.LogError, match="column state: found a list of 1 numbers after lists of 2"):
        teachtree.Log(table, name="ragged")


def test_a_stream_that_was_read_is_refused() -> None:
    pyarrow = pytest.importorskip("pyarrow")
    table = pyarrow.table(columns())

    class Once:
        capsule = table.__arrow_c_stream__()

        def __arrow_c_stream__(self, requested_schema: object = None) -> object:
            return self.capsule

    once = Once()
    teachtree.Log(once, binding=BINDING)
    with pytest.raises(teachtree.LogError, match="released"):
        teachtree.Log(once, binding=BINDING)


def test_recordings_of_a_folder_are_listed() -> None:
    found = teachtree.recordings("demos/dapg_door", binding="demos/bindings/dapg_door.binding.yaml")
    assert found == ["demos/dapg_door/door_00.csv", "demos/dapg_door/door_03.csv"]
    with pytest.raises(teachtree.Error, match="no log"):
        teachtree.recordings("rules")


def test_columns_of_an_arrow_table_that_no_channel_needs_are_not_copied() -> None:
    pyarrow = pytest.importorskip("pyarrow")
    numpy = pytest.importorskip("numpy")
    if not Path("/proc/self/statm").exists():
        pytest.skip("needs /proc")

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

    rows = 100_000
    bound = {name: numpy.resize(values, rows) for name, values in columns().items()}
    bound["t"] = numpy.arange(rows) / 20
    others = {f"other{i}": numpy.full(rows, float(i)) for i in range(300)}
    table = pyarrow.table(bound | others)
    before = resident()
    teachtree.Log(table, binding=BINDING)
    assert resident() - before < table.nbytes / 2


def test_a_column_without_any_category_is_empty(of_file: dict[str, object]) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns())
    frame["note"] = pandas.Categorical([None] * len(frame))
    assert named(teachtree.analyze(teachtree.Log(frame, binding=BINDING)).data) == of_file


def test_decimals_are_numbers_and_a_column_of_nulls_was_never_measured() -> None:
    pyarrow = pytest.importorskip("pyarrow")
    from decimal import Decimal

    rows = 300
    scene = teachtree.Scene("bodies:\n  cube: {role: object, mass: 50 g, parts: [{box: [40 mm, 40 mm, 40 mm]}]}")
    texts = [f"{row / 1000:.3f}" for row in range(rows)]
    plain = {"time": [row / 100 for row in range(rows)]} | {f"cube.position.{axis}": [float(text) for text in texts] for axis in "xyz"}
    kinds = [pyarrow.decimal32(6, 3), pyarrow.decimal128(20, 5), pyarrow.decimal256(60, 4)]
    typed = {f"cube.position.{axis}": pyarrow.array([Decimal(text) for text in texts]).cast(kind) for axis, kind in zip("xyz", kinds, strict=True)}
    table = pyarrow.table({"time": plain["time"], **typed, "right.thumb.force.x": pyarrow.nulls(rows)})
    expected = named(teachtree.analyze(teachtree.Log(plain | {"right.thumb.force.x": [float("nan")] * rows}, scene=scene)).data)
    assert named(teachtree.analyze(teachtree.Log(table, scene=scene)).data) == expected


def test_units_of_a_column_that_a_table_lacks_are_refused() -> None:
    pyarrow = pytest.importorskip("pyarrow")
    with pytest.raises(teachtree.LogError, match="cube_pxx.*no such column"):
        teachtree.Log(pyarrow.table(columns()), binding=BINDING, units={"cube_pxx": "mm"})
