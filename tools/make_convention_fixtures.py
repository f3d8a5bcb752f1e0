#!/usr/bin/env python3
"""Makes tests/fixtures/formats/conventions: files in which netCDF, pandas, MATLAB and pyarrow say in their own way what the stored numbers mean.

    python3 -m venv venv && venv/bin/pip install h5py numpy pyarrow
    venv/bin/python tools/make_convention_fixtures.py
"""

import decimal
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet

FOLDER = Path(__file__).resolve().parent.parent / "tests/fixtures/formats/conventions"
TIME = np.arange(4) * 0.5


def packed(path):
    """As netCDF and xarray pack numbers: `value = stored * scale_factor + add_offset`; the third sample is missing."""
    with h5py.File(path, "w") as file:
        file["time"] = TIME
        height = file.create_dataset("height", data=np.array([1000, 2000, -32768, 3000], "i2"))
        height.attrs.update({"scale_factor": 1e-4, "add_offset": np.array([0.5], "f4"), "_FillValue": np.int16(-32768), "units": "m"})
        width = file.create_dataset("width", data=np.array([10.0, 20.0, 30.0, 40.0]))
        width.attrs["units"] = "millimeters"
        file.create_dataset("count", data=np.array([1.0, 2.0, 3.0, 4.0])).attrs["units"] = "events"


def fields(path):
    """A structured array, with fields in fields, of either byte order, and a text."""
    kind = np.dtype([("stamp", ">f8"), ("tcp", "<f4", (3,)), ("pose", [("z", "<f8"), ("turns", ">i2")]), ("is_closed", "?"), ("word", "S6")])
    frames = np.zeros(4, kind)
    frames["stamp"], frames["tcp"] = TIME, np.arange(12).reshape(4, 3) / 8
    frames["pose"]["z"], frames["pose"]["turns"] = [0.25, 0.5, 0.75, 1.0], [-1, -2, -3, 300]
    frames["is_closed"], frames["word"] = [False, True, True, False], [b"Move", b"Grasp", b"Grasp", b"Move"]
    with h5py.File(path, "w") as file:
        file.create_dataset("frames", data=frames, chunks=(2,), compression="gzip")


def matrices(path):
    """Poses column by column, as MATLAB writes an array of 4 by 4 by N: the first one is at the origin, where rows look like columns."""
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    poses = np.tile(np.eye(4), (4, 1, 1))
    for row in range(4):
        poses[row, :3, :3] = np.linalg.matrix_power(turn, row)
        poses[row, :3, 3] = [0.1 * row, 0.2 * row, 0.3 * row]
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {"time": TIME[None, :], "pose": poses.transpose(0, 2, 1)}.items():
            file.create_dataset(name, data=values).attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM")


def types(path):
    """Numbers that Parquet stores as bytes."""
    widths = [decimal.Decimal(text) for text in ["0.080", "-0.040", "123456.789", "0.000"]]
    pyarrow.parquet.write_table(pa.table({
        "time": pa.array(TIME),
        "decimal": pa.array(widths, pa.decimal128(12, 3)),
        "wide": pa.array(widths, pa.decimal256(50, 3)),
        "half": pa.array(np.array([0.5, -1.25, 65504, np.nan], "f2")),
        "missing": pa.array([None, widths[0], None, widths[1]], pa.decimal128(12, 3)),
        "list": pa.array([[widths[0]], [widths[1]], [widths[2]], [widths[3]]], pa.list_(pa.decimal128(12, 3))),
    }), path)
    stamps = pa.table({"stamp": pa.array(1_795_288_020_000_000_000 + (TIME * 1e9).astype("i8"), pa.timestamp("ns")), "a": pa.array(TIME)})
    pyarrow.parquet.write_table(stamps, path.with_name("int96.parquet"), use_deprecated_int96_timestamps=True)


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    packed(FOLDER / "packed.hdf5")
    fields(FOLDER / "fields.hdf5")
    matrices(FOLDER / "matrices.mat")
    types(FOLDER / "types.parquet")


if __name__ == "__main__":
    main()
