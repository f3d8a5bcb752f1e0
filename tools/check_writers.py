#!/usr/bin/env python3
"""Writes one table with each library that users record with, and checks that `teachtree inspect` finds its rows and the least and largest value of each column.

    python3 -m venv venv && venv/bin/pip install pandas pyarrow polars h5py hdf5storage zarr rosbags mcap mcap-ros2-support foxglove-sdk
    venv/bin/python tools/check_writers.py target/release/teachtree

Prints a row of the table in docs/measurements/recordings.md for each: format, writer and version, and how the writer is called. Libraries that are not installed are left out, and named.
"""

import importlib
import importlib.metadata
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

PROGRAM = Path(sys.argv[1]).resolve()
ROWS = 200
TIME = np.arange(ROWS) * 0.02
TABLE = {
    "time": TIME,
    "x": np.round(0.1 * np.sin(TIME), 6),
    "y": np.round(0.2 + 0.05 * TIME, 6),
    "force": np.round(3 * np.cos(2 * TIME), 6),
    "closed": (TIME > 2).astype(float),
}
WRITERS = []


def writer(form, package, call):
    """Adds a function that writes the table into a folder, and returns the log and its columns by the names of `TABLE`."""

    def add(write):
        WRITERS.append((form, package, call, write))
        return write

    return add


def same(path):
    return path, {name: name for name in TABLE}


def frame():
    return importlib.import_module("pandas").DataFrame(TABLE)


@writer("CSV", "pandas", "`frame.to_csv(…, index=False)`")
def pandas_csv(folder):
    frame().to_csv(folder / "log.csv", index=False)
    return same(folder / "log.csv")


@writer("CSV, decimal commas", "pandas", '`frame.to_csv(…, sep=";", decimal=",")`')
def pandas_semicolons(folder):
    frame().to_csv(folder / "log.csv", index=False, sep=";", decimal=",")
    return same(folder / "log.csv")


@writer("text", "numpy", '`numpy.savetxt(…, header="time x y force closed")`')
def numpy_text(folder):
    np.savetxt(folder / "log.txt", np.column_stack(list(TABLE.values())), header=" ".join(TABLE))
    return same(folder / "log.txt")


@writer("JSON lines", "pandas", '`frame.to_json(…, orient="records", lines=True)`')
def pandas_lines(folder):
    frame().to_json(folder / "log.jsonl", orient="records", lines=True, double_precision=15)
    return same(folder / "log.jsonl")


@writer("Parquet", "pandas", "`frame.to_parquet(…)`")
def pandas_parquet(folder):
    frame().to_parquet(folder / "log.parquet")
    return same(folder / "log.parquet")


@writer("Parquet", "polars", "`frame.write_parquet(…)` (zstd)")
def polars_parquet(folder):
    importlib.import_module("polars").DataFrame(TABLE).write_parquet(folder / "log.parquet")
    return same(folder / "log.parquet")


def pyarrow_parquet(compression):
    @writer("Parquet", "pyarrow", f"`write_table(…, compression={compression!r})`".replace("'", '"'))
    def write(folder):
        pyarrow = importlib.import_module("pyarrow")
        importlib.import_module("pyarrow.parquet").write_table(pyarrow.table(TABLE), folder / "log.parquet", compression=compression)
        return same(folder / "log.parquet")


for compression in ("none", "gzip", "lz4"):
    pyarrow_parquet(compression)


@writer("NPZ", "numpy", "`numpy.savez_compressed(…)`")
def numpy_npz(folder):
    np.savez_compressed(folder / "log.npz", **TABLE)
    return same(folder / "log.npz")


@writer("NPY", "numpy", "`numpy.save(…)` of a structured array")
def numpy_npy(folder):
    table = np.zeros(ROWS, [(name, "f8") for name in TABLE])
    for name, values in TABLE.items():
        table[name] = values
    np.save(folder / "log.npy", table)
    return same(folder / "log.npy")


@writer("HDF5", "h5py", '`create_dataset(…, compression="gzip", shuffle=True)`')
def h5py_gzip(folder):
    with importlib.import_module("h5py").File(folder / "log.h5", "w") as file:
        for name, values in TABLE.items():
            file.create_dataset(name, data=values, compression="gzip", shuffle=True)
    return same(folder / "log.h5")


@writer("HDF5", "h5py", '`File(…, "w", libver="latest")`')
def h5py_latest(folder):
    with importlib.import_module("h5py").File(folder / "log.h5", "w", libver="latest") as file:
        for name, values in TABLE.items():
            file.create_dataset(name, data=values)
    return same(folder / "log.h5")


@writer("MATLAB 7.3", "hdf5storage", '`savemat(…, format="7.3")`')
def matlab(folder):
    rows = {name: values.reshape(-1, 1) for name, values in TABLE.items()}
    importlib.import_module("hdf5storage").savemat(str(folder / "log.mat"), rows, format="7.3")
    return folder / "log.mat", {name: name for name in TABLE}


def zarr_store(version):
    @writer(f"Zarr {version}", "zarr", f"`open_group(…, zarr_format={version})`, `create_array(…)`")
    def write(folder):
        zarr = importlib.import_module("zarr")
        group = zarr.open_group(str(folder / "log.zarr"), mode="w", zarr_format=version)
        for name, values in TABLE.items():
            group.create_array(name, data=values)
        return same(folder / "log.zarr")


for version in (2, 3):
    zarr_store(version)


def messages():
    """Stamps in ns, and the numbers of a message."""
    for row in range(ROWS):
        yield 1_700_000_000_000_000_000 + row * 20_000_000, {name: float(values[row]) for name, values in TABLE.items() if name != "time"}


def topic(path):
    return path, {name: f"/log.{name}" for name in TABLE if name != "time"}


@writer("MCAP, JSON", "mcap", '`Writer.register_channel(…, "json", …)` (zstd)')
def mcap_json(folder):
    from mcap.writer import Writer

    with open(folder / "log.mcap", "wb") as file:
        out = Writer(file)
        out.start()
        schema = out.register_schema("log", "jsonschema", b'{"type": "object"}')
        channel = out.register_channel("/log", "json", schema)
        for stamp, numbers in messages():
            out.add_message(channel, stamp, json.dumps(numbers).encode(), stamp)
        out.finish()
    return topic(folder / "log.mcap")


@writer("MCAP, CDR", "mcap-ros2-support", "`Writer.write_message(…)`")
def mcap_ros2(folder):
    from mcap_ros2.writer import Writer

    with open(folder / "log.mcap", "wb") as file:
        out = Writer(file)
        fields = "\n".join(f"float64 {name}" for name in TABLE if name != "time")
        schema = out.register_msgdef("my_msgs/msg/Log", fields)
        for stamp, numbers in messages():
            out.write_message("/log", schema, numbers, stamp, stamp)
        out.finish()
    return topic(folder / "log.mcap")


@writer("MCAP, JSON", "foxglove-sdk", "`foxglove.open_mcap(…)`, `foxglove.Channel.log(…)`")
def foxglove_sdk(folder):
    foxglove = importlib.import_module("foxglove")
    channel = foxglove.Channel("/log", schema={"type": "object"}, message_encoding="json")
    with foxglove.open_mcap(str(folder / "log.mcap")):
        for stamp, numbers in messages():
            channel.log(numbers, log_time=stamp)
    return topic(folder / "log.mcap")


def rosbag(kind, form, storage):
    @writer(form, "rosbags", f"`rosbags.{kind}.Writer(…)`" + (f" ({storage})" if storage else ""))
    def write(folder):
        typesys = importlib.import_module("rosbags.typesys")
        bags = importlib.import_module(f"rosbags.{kind}")
        store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE if kind == "rosbag2" else typesys.Stores.ROS1_NOETIC)
        name = "geometry_msgs/msg/Quaternion"
        options = {"version": 9, "storage_plugin": bags.StoragePlugin[storage]} if storage else {}
        with bags.Writer(folder / ("bag" if storage else "log.bag"), **options) as out:
            connection = out.add_connection("/log", name, typestore=store)
            for stamp, numbers in messages():
                message = store.types[name](*(numbers[key] for key in ("x", "y", "force", "closed")))
                data = store.serialize_cdr(message, name) if storage else store.serialize_ros1(message, name)
                out.write(connection, stamp, data)
        path = folder / ("bag" if storage else "log.bag")
        return path, dict(zip(("x", "y", "force", "closed"), ("/log.x", "/log.y", "/log.z", "/log.w")))


rosbag("rosbag1", "ROS 1 bag", "")
rosbag("rosbag2", "ROS 2 bag in MCAP", "MCAP")
rosbag("rosbag2", "ROS 2 bag in SQLite", "SQLITE3")


def fault(path, columns):
    """What `inspect` finds of a log that differs from the table; none if all is equal."""
    done = subprocess.run([PROGRAM, "inspect", path, "--format", "json"], capture_output=True, text=True)
    if done.returncode != 0:
        return done.stderr.strip()
    sheets = json.loads(done.stdout)["sheets"]
    found = {(f'{sheet["name"]}.' if sheet["name"] and not column["name"].startswith("/") else "") + column["name"]: (sheet, column) for sheet in sheets for column in sheet["columns"]}
    for name, title in columns.items():
        if name == "time":
            continue
        if title not in found:
            return f"no column {title} among {sorted(found)}"
        sheet, column = found[title]
        wanted = (ROWS, TABLE[name].min(), TABLE[name].max())
        if (sheet["rows"], column["min"], column["max"]) != wanted:
            return f"{title}: {sheet['rows']}, {column['min']}, {column['max']}, expected {wanted}"
        if abs(sheet["rate_hz"] - 50) > 1e-6:
            return f"{title}: {sheet['rate_hz']} Hz, expected 50 Hz"
    return None


def main():
    faults = []
    for form, package, call, write in WRITERS:
        with tempfile.TemporaryDirectory() as folder:
            try:
                found = fault(*write(Path(folder)))
            except ImportError as error:
                print(f"left out: {form} of {package}: {error}", file=sys.stderr)
                continue
        print(f"| {form} | {package} {importlib.metadata.version(package)} | {call} |")
        if found:
            faults.append(f"{form}, {package}, {call}: {found}")
    sys.exit("\n".join(faults) or None)


if __name__ == "__main__":
    main()
