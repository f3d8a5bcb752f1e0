#!/usr/bin/env python3
"""Makes the small files in tests/fixtures/formats/stores, and the columns that a reader must find in them (`expected.json`).

    python3 -m venv venv3 && venv3/bin/pip install numpy==2.4.6 zarr==3.1.6
    python3 -m venv venv2 && venv2/bin/pip install numpy==2.4.6 zarr==2.18.7 numcodecs==0.15.2
    venv3/bin/python tools/make_store_fixtures.py && venv2/bin/python tools/make_store_fixtures.py

NumPy writes NPY and NPZ, zarr 3 writes stores of version 3 and of version 2 (`*_by_3`), zarr 2 those of version 2: replay buffers as Diffusion Policy and
UMI write them, and an array with each codec. The expected columns are what NumPy and zarr themselves read.
"""

import json
import math
import shutil
import zipfile
from pathlib import Path

import numpy as np
import zarr

FOLDER = Path(__file__).resolve().parent.parent / "tests/fixtures/formats/stores"
IS_3 = int(zarr.__version__.split(".")[0]) >= 3


def poses(rows):
    """Poses [rows, 4, 4] that turn by 0.1 rad a row about z."""
    matrices = np.tile(np.eye(4), (rows, 1, 1))
    for row in range(rows):
        c, s = math.cos(0.1 * row), math.sin(0.1 * row)
        matrices[row, :2, :2] = [[c, -s], [s, c]]
        matrices[row, :3, 3] = [0.1 * row, -0.2, 0.3]
    return matrices


def values(shape, dtype="f8"):
    """Numbers that packers find something in, exact in every type of two bytes and more."""
    at = np.arange(math.prod(shape)).reshape(shape)
    return ((at * 31 + at // 7) % 509 / 8 - 20).astype(dtype)


def spread(name, array):
    """The columns of an array, as docs/logs.md names them."""
    if array.shape[1:] == (4, 4):
        columns = {f"{name}.position.{axis}": array[:, at, 3] for at, axis in enumerate("xyz")}
        half = 0.05 * np.arange(len(array))
        return columns | {f"{name}.rotation.w": np.cos(half), f"{name}.rotation.z": np.sin(half)}
    return {name + "".join(f"[{index}]" for index in at): array[(slice(None), *at)] for at in np.ndindex(*array.shape[1:])}


def texts(columns):
    """Columns as texts of numbers, since readers of JSON round; one that is long and equal to one before is `= title`."""
    found, known = {}, {}
    for title, column in columns.items():
        text = " ".join(repr(float(value)) for value in column)
        found[title] = f"= {known[text]}" if len(column) > 100 and text in known else text
        known.setdefault(text, title)
    return found


def numpy_files(expected):
    arrays = {
        "action": values((12, 3)),
        "qpos": values((12, 2), "f4"),
        "pose": poses(12),
        "half": values((12,), "f2"),
        "big": values((12,), ">f8"),
        "count": np.arange(-6, 6, dtype="i2"),
        "byte": np.arange(12, dtype="u1"),
        "small": np.arange(-6, 6, dtype="i1"),
        "flag": np.arange(12) % 3 == 0,
        "sorted": np.asfortranarray(values((12, 2, 3))),
        "once": np.array([[1.5, 2.5]]),
        "other": values((5, 2)),
        "stamp": np.datetime64("2026-11-24T09:00:00") + np.arange(12) * np.timedelta64(250, "ms"),
    }
    left_out = {
        "word": np.array([f"wörd {row}" for row in range(12)]),
        "image": np.zeros((12, 20, 20, 3), "u1"),
        "objects": np.array([{"a": row} for row in range(12)], dtype=object),
        "complex": values((12,)).astype("c16"),
        "fps": np.array(20),
    }
    np.savez_compressed(FOLDER / "arrays.npz", **arrays, **left_out)
    np.savez(FOLDER / "plain.npz", action=arrays["action"], dt=np.float32(0.125))
    columns = {"time [s]": np.arange(12) / 20}
    for name, array in arrays.items():
        if name == "once":
            array = np.repeat(array, 12, axis=0)
        if name == "stamp":
            array = array.astype("i8") / 1e3
        columns |= spread("rows_5.other" if name == "other" else name, array.astype("f8"))
    expected["arrays.npz"] = texts(columns)
    expected["plain.npz"] = texts({"time [s]": np.arange(12) / 8} | spread("action", arrays["action"]))
    # A structured array, with room between its fields.
    of = np.dtype([("flag", "?"), ("time", "<f8"), ("force", ">f4", (3,)), ("pose", [("at", "<f8", (3,)), ("turn", "<i2")])], align=True)
    table = np.zeros(9, of)
    table["flag"], table["time"] = np.arange(9) % 2 == 0, np.arange(9) / 100
    table["force"], table["pose"]["at"], table["pose"]["turn"] = values((9, 3)), values((9, 3)) * 2, np.arange(9) - 4
    np.save(FOLDER / "table.npy", table)
    columns = {"flag": table["flag"], "time": table["time"], "pose/turn": table["pose"]["turn"]}
    expected["table.npy"] = texts(columns | spread("force", table["force"]) | spread("pose/at", table["pose"]["at"]))
    np.save(FOLDER / "matrix.npy", np.asfortranarray(arrays["qpos"]))
    expected["matrix.npy"] = texts(spread("arr_0", arrays["qpos"]))
    folder = FOLDER / "folder"
    folder.mkdir(exist_ok=True)
    np.save(folder / "qpos.npy", arrays["qpos"])
    np.save(folder / "timestamps.npy", np.arange(12) / 50)
    expected["folder"] = texts(spread("qpos", arrays["qpos"]) | {"timestamps": np.arange(12) / 50})


def archive(folder, path):
    """A folder as an archive whose files are as they are, as UMI has it."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as out:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                info = zipfile.ZipInfo(str(file.relative_to(folder)))
                out.writestr(info, file.read_bytes())
    shutil.rmtree(folder)


def replay_buffer(root, expected, log):
    """As Diffusion Policy's ReplayBuffer."""
    from numcodecs import Blosc

    squeezed = Blosc(cname="zstd", clevel=5, shuffle=1)
    create = lambda group, name, data, chunks: group.array(name, data, chunks=chunks, compressor=squeezed)
    ends = [7, 7, 18, 30]
    data, meta = root.create_group("data"), root.create_group("meta")
    arrays = {"action": values((30, 2), "f4"), "state": values((30, 5), "f4"), "tool": poses(30)}
    for name, array in arrays.items():
        create(data, name, array, (8, *array.shape[1:]))
    create(data, "img", np.zeros((30, 12, 12, 3), "f4"), (8, 12, 12, 3))
    create(meta, "episode_ends", np.array(ends, "i8"), (4,))
    for episode, (start, end) in enumerate(zip([0, *ends], ends)):
        columns = {}
        for name, array in arrays.items():
            columns |= {title: column[start:end] for title, column in spread(name, array).items()}
        if start < end:
            expected[f"{log}#{episode}"] = texts(columns)


def by_zarr_2(expected):
    from numcodecs import BZ2, LZ4, Blosc, Delta, GZip, Zlib, Zstd

    path = FOLDER / "replay_buffer.zarr"
    shutil.rmtree(path, ignore_errors=True)
    replay_buffer(zarr.group(zarr.DirectoryStore(str(path)), overwrite=True), expected, path.name)
    # UMI's images went through a codec that zarr itself does not have.
    path = FOLDER / "umi.zarr"
    root = zarr.group(zarr.DirectoryStore(str(path)), overwrite=True)
    replay_buffer(root, expected, "umi.zarr.zip")
    (path / "data/img/.zarray").write_text(json.dumps({**json.loads((path / "data/img/.zarray").read_text()), "compressor": {"id": "imagecodecs_jpegxl", "effort": 3}}))
    archive(path, FOLDER / "umi.zarr.zip")
    path = FOLDER / "codecs_2.zarr"
    root = zarr.group(zarr.DirectoryStore(str(path)), overwrite=True)
    root.attrs["fps"] = 10
    whole = values((320, 3))
    named = {
        "none": None, "gzip": GZip(), "zlib": Zlib(), "zstd": Zstd(), "lz4": LZ4(), "bz2": BZ2(),
        "blosc_lz4_0": Blosc("lz4", shuffle=0), "blosc_lz4_1": Blosc("lz4", shuffle=1), "blosc_lz4_2": Blosc("lz4", shuffle=2, blocksize=2048),
        "blosc_lz4hc": Blosc("lz4hc", shuffle=1), "blosc_zlib": Blosc("zlib", shuffle=1, blocksize=1024), "blosc_zstd": Blosc("zstd", shuffle=2),
        "blosc_lz": Blosc("blosclz", shuffle=1), "blosc_none": Blosc("lz4", clevel=0),
    }
    read = {}
    for name, codec in named.items():
        array = root.array(name, whole, chunks=(100, 2) if name in ("zlib", "blosc_lz4_1") else (320, 3), compressor=codec)
        read[name] = array[:]
    read["fortran"] = root.array("fortran", whole, chunks=(100, 2), order="F")[:]
    read["delta"] = root.array("delta", whole, filters=[Delta("f8")])[:]
    read["nested"] = root.array("nested", whole, chunks=(64, 1), dimension_separator="/")[:]
    for kind in ["<f4", ">f4", "<f2", "<i2", ">i4", "<i8", "u1", "bool"]:
        read[f"of_{kind.strip('<>')}_{kind[0] == '>'}"] = root.array(f"of_{kind.strip('<>')}_{kind[0] == '>'}", whole.astype(kind), chunks=(200, 3))[:]
    gaps = root.create_dataset("gaps", shape=(320, 3), chunks=(50, 3), dtype="f8", fill_value=1.5, compressor=Blosc("zstd"))
    gaps[60:90] = whole[60:90]
    read["gaps"] = gaps[:]
    root.array("words", np.array([f"w{row % 7}" for row in range(320)]), chunks=(100,))
    archive(path, FOLDER / "codecs_2.zarr.zip")
    columns = {"time [s]": np.arange(320) / 10}
    for name, array in read.items():
        if name not in ("bz2", "delta", "blosc_lz"):
            columns |= spread(name, array.astype("f8"))
    expected["codecs_2.zarr.zip"] = texts(columns)


def shards():
    """Arrays in shards: their index at either end, with other codecs, and parts that were never written. Returns the columns."""
    from zarr.codecs import BloscCodec, BytesCodec, TransposeCodec

    data = values((50, 3))
    path = FOLDER / "shards_3.zarr"
    shutil.rmtree(path, ignore_errors=True)
    root = zarr.open_group(str(path), mode="w", zarr_format=3)
    columns = {}

    def add(name, written=slice(None), location="end", chunks=(8, 2), shape=(16, 4), **options):
        config = {"shape": shape, "index_location": location}
        array = root.create_array(name, shape=data.shape, dtype=data.dtype, chunks=chunks, shards=config, **options)
        array[written] = data[written]
        columns.update(spread(name, array[:]))

    add("usual")
    add("at_start", location="start")
    add("plain", compressors=None)
    add("blosc", compressors=BloscCodec(cname="lz4", shuffle="shuffle"), chunks=(8, 4))
    add("transposed", filters=[TransposeCodec(order=(1, 0))])
    add("big_endian", serializer=BytesCodec(endian="big"), compressors=None)
    add("whole", chunks=(64, 4), shape=(64, 4))
    add("gaps", slice(20, 30), fill_value=-2)
    archive(path, FOLDER / "shards_3.zarr.zip")
    return columns


def by_zarr_3(expected):
    from zarr.codecs import BloscCodec, BytesCodec, Crc32cCodec, GzipCodec, TransposeCodec, ZstdCodec

    whole = values((320, 3))
    path = FOLDER / "codecs_3.zarr"
    shutil.rmtree(path, ignore_errors=True)
    root = zarr.open_group(str(path), mode="w", zarr_format=3)
    root.attrs["fps"] = 10
    read = {}

    def add(name, data=whole, chunks=(100, 2), **options):
        array = root.create_array(name, shape=data.shape, dtype=data.dtype, chunks=chunks, **options)
        array[:] = data
        read[name] = array[:]

    add("none", compressors=None)
    add("usual")
    add("gzip", compressors=GzipCodec())
    add("zstd", compressors=ZstdCodec(level=5, checksum=True))
    for cname, shuffle in [("lz4", "shuffle"), ("zstd", "bitshuffle"), ("zlib", "noshuffle"), ("blosclz", "shuffle")]:
        add(f"blosc_{cname}", compressors=BloscCodec(cname=cname, shuffle=shuffle), chunks=(320, 3))
    add("checked", compressors=[ZstdCodec(), Crc32cCodec()])
    add("transposed", filters=[TransposeCodec(order=(1, 0))])
    add("big_endian", serializer=BytesCodec(endian="big"))
    add("dotted", chunk_key_encoding={"name": "v2", "separator": "."})
    add("sharded", chunks=(20, 3), shards=(160, 3))
    for kind in ["f4", "f2", "i2", "u4", "bool", "int8"]:
        add(f"of_{kind}", whole.astype(kind))
    gaps = root.create_array("gaps", shape=(320, 3), chunks=(50, 3), dtype="f8", fill_value=-2)
    gaps[60:90] = whole[60:90]
    read["gaps"] = gaps[:]
    archive(path, FOLDER / "codecs_3.zarr.zip")
    columns = {"time [s]": np.arange(320) / 10}
    for name, array in read.items():
        if name != "blosc_blosclz":
            columns |= spread(name, array.astype("f8"))
    expected["codecs_3.zarr.zip"] = texts(columns)
    expected["shards_3.zarr.zip"] = texts(shards())
    # A group a demonstration.
    for version in (2, 3):
        path = FOLDER / f"demos_{version}_by_3.zarr"
        shutil.rmtree(path, ignore_errors=True)
        root = zarr.open_group(str(path), mode="w", zarr_format=version)
        data = root.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_kwargs": {"control_freq": 20}})
        for name, rows in [("demo_0", 6), ("demo_10", 4)]:
            demo = data.create_group(name)
            demo.create_array("actions", data=values((rows, 2)), chunks=(rows, 2))
            demo.create_array("obs/eef_pose", data=poses(rows), chunks=(rows, 4, 4))
            columns = {"time [s]": np.arange(rows) / 20} | spread("actions", values((rows, 2))) | spread("obs/eef_pose", poses(rows))
            expected[f"{path.name}#{name}"] = texts(columns)
    path = FOLDER / "alone.zarr"
    shutil.rmtree(path, ignore_errors=True)
    zarr.create_array(str(path), data=values((8, 2)), chunks=(8, 2))
    archive(path, FOLDER / "alone.zarr.zip")
    expected["alone.zarr.zip"] = texts(spread("arr_0", values((8, 2))))


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / "expected.json"
    expected = json.loads(path.read_text()) if path.is_file() else {}
    if IS_3:
        numpy_files(expected)
        by_zarr_3(expected)
    else:
        by_zarr_2(expected)
    path.write_text(json.dumps(expected, indent=0, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
