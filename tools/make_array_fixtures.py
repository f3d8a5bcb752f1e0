#!/usr/bin/env python3
"""Makes the small files in tests/fixtures/formats/arrays, and the columns that a reader must find in them.

    python3 -m venv venv && venv/bin/pip install h5py hdf5storage numpy mujoco robosuite==1.4.1 --no-deps
    venv/bin/python tools/make_array_fixtures.py [--robosuite WHEEL_FOLDER]

The layouts are those that robomimic, MimicGen, Isaac Lab, ALOHA, EgoDex and MATLAB (`save -v7.3`) write. `robosuite_lift.hdf5` is every 20th row of a recording of
robosuite (`robosuite/models/assets/demonstrations/lift/demo.hdf5`, MIT), its model without meshes; MuJoCo computes its poses. `expected.json`
has, for each recording, the columns with their values as h5py or numpy reads them. `robosuite.json` has the sums of every data set of the
recordings that come with robosuite; `demos/robosuite/lift.hdf5` has two of them whole.
"""

import argparse
import json
import math
import sys
import xml.etree.ElementTree as xml
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "tests/fixtures/formats/arrays"


def rotation(axis, angle):
    axis = np.array(axis, float) / np.linalg.norm(axis)
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def poses(rows, axis, start=0.0, dtype=np.float64):
    """Poses [rows, 4, 4] that turn by 0.5 rad a row, beyond half a turn."""
    matrices = np.zeros((rows, 4, 4))
    for row in range(rows):
        matrices[row, :3, :3] = rotation(axis, start + 0.5 * row)
        matrices[row, :3, 3] = [0.1 * row, -0.2, 0.3 + 0.01 * row]
        matrices[row, 3, 3] = 1
    return matrices.astype(dtype)


def quaternion(matrix):
    """w x y z of a rotation matrix, by its largest component."""
    m = np.asarray(matrix, float)
    squares = np.array([1 + m[0, 0] + m[1, 1] + m[2, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2],
                        1 - m[0, 0] + m[1, 1] - m[2, 2], 1 - m[0, 0] - m[1, 1] + m[2, 2]])
    at = int(np.argmax(squares))
    big = math.sqrt(squares[at]) / 2
    rows = {
        0: [big, (m[2, 1] - m[1, 2]) / (4 * big), (m[0, 2] - m[2, 0]) / (4 * big), (m[1, 0] - m[0, 1]) / (4 * big)],
        1: [(m[2, 1] - m[1, 2]) / (4 * big), big, (m[0, 1] + m[1, 0]) / (4 * big), (m[0, 2] + m[2, 0]) / (4 * big)],
        2: [(m[0, 2] - m[2, 0]) / (4 * big), (m[0, 1] + m[1, 0]) / (4 * big), big, (m[1, 2] + m[2, 1]) / (4 * big)],
        3: [(m[1, 0] - m[0, 1]) / (4 * big), (m[0, 2] + m[2, 0]) / (4 * big), (m[1, 2] + m[2, 1]) / (4 * big), big],
    }
    q = np.array(rows[at])
    return q / np.linalg.norm(q)


def robomimic(path):
    random = np.random.default_rng(1)
    with h5py.File(path, "w") as file:
        data = file.create_group("data")
        data.attrs["total"] = 20
        data.attrs["env_args"] = json.dumps({"env_name": "Lift", "type": 1, "env_kwargs": {"control_freq": 20}}, indent=4)
        for name, rows in [("demo_0", 6), ("demo_10", 4), ("demo_2", 5)]:
            demo = data.create_group(name)
            demo.attrs["num_samples"] = rows
            demo.attrs["model_file"] = "model.xml"
            squeezed = {"compression": "gzip", "shuffle": True, "chunks": (2, 7)}
            demo.create_dataset("actions", data=random.normal(size=(rows, 7)), **squeezed)
            demo["rewards"] = np.linspace(0, 1, rows)
            demo["dones"] = np.arange(rows) == rows - 1
            demo["words"] = np.array([f"word {row}" for row in range(rows)], dtype=object)
            demo["fixed"] = np.array([f"w{row}" for row in range(rows)], dtype="S4")
            obs = demo.create_group("obs")
            obs["robot0_eef_pos"] = random.normal(size=(rows, 3)).astype(np.float32)
            q = random.normal(size=(rows, 4))
            obs["robot0_eef_quat"] = q / np.linalg.norm(q, axis=1, keepdims=True)
            obs.create_dataset("object", data=random.normal(size=(rows, 3)), compression="lzf")
            obs.create_dataset("agentview_image", data=np.zeros((rows, 12, 12, 3), np.uint8), compression="gzip")
            info = demo.create_group("datagen_info")
            info["eef_pose"] = poses(rows, [0, 0, 1])
            info["object_poses/cube"] = poses(rows, [1, 1, 0], start=2.5)
            info["subtask_term_signals/grasp"] = (np.arange(rows) > 2).astype(np.int64)
            # Another clock, as the devices of a teleoperator have.
            demo["device/buttons"] = np.arange(9, dtype=np.uint8)
            demo["device/count"] = np.int16(3)
        file["mask/train"] = np.array([b"demo_0", b"demo_2"])


def isaac(path):
    with h5py.File(path, "w") as file:
        data = file.create_group("data")
        data.attrs["total"] = 5
        data.attrs["env_args"] = json.dumps({"env_name": "Isaac-Stack-Cube", "type": 2, "sim_args": {"dt": 0.01, "decimation": 5}})
        demo = data.create_group("demo_0")
        demo.attrs["num_samples"] = 5
        demo.attrs["success"] = True
        demo["actions"] = np.arange(35, dtype=np.float32).reshape(5, 7)
        demo["initial_state/rigid_object/cube_1/root_pose"] = np.array([[0.1, 0.2, 0.3, 1, 0, 0, 0]], np.float32)
        demo["obs/datagen_info/object_pose/cube_1"] = poses(5, [0, 1, 0], dtype=np.float32)
        demo["obs/datagen_info/eef_pose/franka"] = poses(5, [1, 0, 0], dtype=np.float32)
        demo["obs/datagen_info/subtask_term_signals/grasp_1"] = np.array([False, False, True, True, True])


def aloha(path):
    with h5py.File(path, "w", rdcc_nbytes=1024**2) as file:
        file.attrs["sim"] = True
        file["action"] = np.arange(56, dtype=np.float64).reshape(4, 14)
        for name in ["qpos", "qvel"]:
            file[f"observations/{name}"] = np.linspace(-1, 1, 56).reshape(4, 14)
        file.create_dataset("observations/images/top", data=np.zeros((4, 12, 16, 3), np.uint8), chunks=(1, 12, 16, 3))


def egodex(path):
    with h5py.File(path, "w") as file:
        file.attrs["llm_description"] = "put the cup on the table"
        file["camera/intrinsic"] = np.eye(3, dtype=np.float32)
        for at, joint in enumerate(["camera", "leftHand", "rightIndexFingerTip"]):
            file[f"transforms/{joint}"] = poses(4, [0, 0, 1], start=at, dtype=np.float32)
            file[f"confidences/{joint}"] = np.full(4, 0.5 + 0.1 * at, np.float32)


def matlab(path):
    """Variables as MATLAB's `save -v7.3` writes them: a user block, reversed dimensions. Returns the columns that they are in MATLAB."""
    import hdf5storage

    random = np.random.default_rng(2)
    variables = {
        "t": np.arange(5) / 50.0,
        "eef_pos": random.normal(size=(5, 3)),
        "object_pose": poses(5, [0, 1, 1]).transpose(0, 1, 2),
        "closed": np.array([False, False, True, True, False]),
        "count": np.arange(5, dtype=np.int16),
        "obs": {"width": np.linspace(0.08, 0.02, 5).astype(np.float32)},
    }
    others = {"note": "by hand", "parts": np.array(["a", "bc"], dtype=object), "none": np.zeros((0, 3))}
    path.unlink(missing_ok=True)
    hdf5storage.writes(variables | others, filename=str(path), matlab_compatible=True, oned_as="row", structured_numpy_ndarray_as_struct=True)
    flat = {f"obs/{name}" if name == "width" else name: value for name, value in (variables | variables["obs"]).items() if name != "obs"}
    return {title: column for name, value in flat.items() for title, column in spread(name, value.astype(float)).items()}


def user_block(path):
    """A file with a user block of 1024 bytes, as h5py makes it."""
    with h5py.File(path, "w", userblock_size=1024) as file:
        file["data/demo_0/actions"] = np.arange(8.0).reshape(4, 2)


def floats(path):
    """Floating point numbers of other layouts than IEEE 754 of 32 and 64 bits. Returns the columns as HDF5 converts them."""
    layouts = {"half": h5py.h5t.IEEE_F16LE, "half_big": h5py.h5t.IEEE_F16BE, "bias": h5py.h5t.IEEE_F32LE.copy(),
               "bias_big": h5py.h5t.IEEE_F64BE.copy(), "brain": h5py.h5t.IEEE_F16LE.copy()}
    layouts["bias"].set_ebias(130)
    layouts["bias_big"].set_ebias(1000)
    layouts["brain"].set_fields(15, 7, 8, 0, 7)
    layouts["brain"].set_ebias(127)
    values = np.array([[0.0, -0.0, 1.5, -2.25], [6.1e-5, 1e-7, 0.1, 1000.0], [3e-8, 65504.0, -3.0, 3.0]])
    columns = {}
    with h5py.File(path, "w") as file:
        for name, layout in layouts.items():
            dataset = h5py.h5d.create(file.id, name.encode(), layout, h5py.h5s.create_simple(values.shape))
            dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, values)
            read = np.zeros(values.shape)
            dataset.read(h5py.h5s.ALL, h5py.h5s.ALL, read, mtype=h5py.h5t.NATIVE_DOUBLE)
            columns.update(spread(name, read))
        # A check sum before another filter.
        chunked = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        chunked.set_chunk((2,))
        chunked.set_fletcher32()
        chunked.set_shuffle()
        summed = h5py.h5d.create(file.id, b"summed", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((3,)), chunked)
        summed.write(h5py.h5s.ALL, h5py.h5s.ALL, np.arange(3.0))
        file["long"] = np.ones(3, np.longdouble)
        file["stamp"] = np.array([b"a", b"b", b"c"], dtype="V4")
        file.create_dataset("ragged", (3,), dtype=h5py.vlen_dtype(np.float64))
    return columns


def bare(model):
    """A model without what is only seen."""
    root = xml.fromstring(model)
    for tag in ["asset", "visual", "sensor", "actuator", "contact", "tendon", "equality", "size", "statistic"]:
        for node in root.findall(tag):
            root.remove(node)
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in ("geom", "site", "camera", "light"):
                parent.remove(child)
    return xml.tostring(root, encoding="unicode")


def robosuite_lift(path, wheel):
    """Every 20th row of a recording, and the poses that MuJoCo gives its bodies."""
    import mujoco

    source = wheel / "robosuite/models/assets/demonstrations/lift/demo.hdf5"
    with h5py.File(source) as file, h5py.File(path, "w") as out:
        demo = file["data/demo_1"]
        text, states = bare(demo.attrs["model_file"]), demo["states"][::20]
        data = out.create_group("data")
        for key in ["date", "env", "env_info", "repository_version"]:
            data.attrs[key] = file["data"].attrs[key]
        own = data.create_group("demo_1")
        own.attrs["model_file"] = text
        own["states"], own["actions"] = states, demo["actions"][::20]
    # MuJoCo wants masses, which do not move the frames of bodies.
    weighed = xml.fromstring(text)
    for body in weighed.iter("body"):
        if body.find("inertial") is None:
            xml.SubElement(body, "inertial", pos="0 0 0", mass="1", diaginertia="1 1 1")
    model = mujoco.MjModel.from_xml_string(xml.tostring(weighed, encoding="unicode"))
    state = mujoco.MjData(model)
    columns = {}
    for row in states:
        state.qpos[:], state.qvel[:] = row[1 : 1 + model.nq], row[1 + model.nq :]
        mujoco.mj_kinematics(model, state)
        for body in range(1, model.nbody):
            if model.body_weldid[body] == 0:
                continue
            name = model.body(body).name
            names = [f"position.{axis}" for axis in "xyz"] + [f"rotation.{axis}" for axis in "wxyz"]
            for part, value in zip(names, [*state.xpos[body], *state.xquat[body]]):
                columns.setdefault(f"bodies/{name}.{part}", []).append(float(value))
        for joint in range(model.njnt):
            if int(model.jnt_type[joint]) in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
                value = float(state.qpos[model.jnt_qposadr[joint]])
                columns.setdefault(f"joints/{model.joint(joint).name}", []).append(value)
    return columns


def demo(path, wheel):
    """Two whole recordings of robosuite's, their models without meshes: demos/robosuite/lift.hdf5."""
    with h5py.File(wheel / "robosuite/models/assets/demonstrations/lift/demo.hdf5") as file, h5py.File(path, "w") as out:
        data = out.create_group("data")
        for key, value in file["data"].attrs.items():
            data.attrs[key] = value
        for name in ["demo_1", "demo_3"]:
            own = data.create_group(name)
            own.attrs["model_file"] = bare(file[f"data/{name}"].attrs["model_file"])
            for key in ["states", "actions"]:
                own.create_dataset(key, data=file[f"data/{name}/{key}"][()], compression="gzip", compression_opts=9, shuffle=True)


def links(folder):
    """A link that is not an object, in each of the ways in which groups store links; many groups without one; a recording that is a link."""
    folder.mkdir(exist_ok=True)
    for name, libver, count, link in [
        ("soft", "earliest", 1, h5py.SoftLink("/data/demo_0/actions")),
        ("external", "earliest", 1, h5py.ExternalLink("other.hdf5", "/actions")),
        ("soft_compact", "v110", 1, h5py.SoftLink("/data/demo_0/actions")),
        ("external_dense", "v110", 20, h5py.ExternalLink("other.hdf5", "/actions")),
        ("none_dense", "v110", 20, None),
    ]:
        with h5py.File(folder / f"{name}.hdf5", "w", libver=(libver, "v110")) as file:
            for demo in range(count):
                file[f"data/demo_{demo}/actions"] = np.arange(4.0)
            if link:
                file["data/linked"] = link
    with h5py.File(folder / "recording.hdf5", "w") as file:
        file["data/demo_0/actions"] = np.arange(4.0)
        file["data/demo_1"] = h5py.ExternalLink("other.hdf5", "/data/demo_1")


def spread(name, values):
    """The columns of an array, as docs/logs.md names them."""
    rows, inner = values.shape[0], values.shape[1:]
    if inner[-2:] == (4, 4) and np.allclose(values[0].reshape(-1, 4, 4)[:, 3], [0, 0, 0, 1]):
        columns = {}
        for at in np.ndindex(*inner[:-2]):
            title = name + "".join(f"[{index}]" for index in at)
            before = np.array([1.0, 0, 0, 0])
            for row in range(rows):
                matrix = values[(row, *at)]
                q = quaternion(matrix[:3, :3])
                before = q if q @ before >= 0 else -q
                parts = [*(f"position.{axis}" for axis in "xyz"), *(f"rotation.{axis}" for axis in "wxyz")]
                for part, value in zip(parts, [*matrix[:3, 3], *before]):
                    columns.setdefault(f"{title}.{part}", []).append(float(value))
        return columns
    return {name + "".join(f"[{index}]" for index in at): [float(value) for value in values[(slice(None), *at)]] for at in np.ndindex(*inner)}


def expected(group, rows):
    """The columns of a recording of HDF5: numbers of `rows` rows, what is said once held; texts left out."""
    columns = {}

    def visit(name, item):
        if not isinstance(item, h5py.Dataset) or item.ndim == 0 or math.prod(item.shape[1:]) > 256 or item.dtype.kind in "SO":
            return
        values = item[()]
        if values.shape[0] not in (1, rows):
            columns.update({f"rows_{values.shape[0]}.{title}": column for title, column in spread(name, values).items()})
            return
        held = np.repeat(values, rows, axis=0) if values.shape[0] == 1 else values
        columns.update(spread(name, held))

    group.visititems(visit)
    return columns


def sums(wheel):
    """For every data set of robosuite's own recordings: its shape, and of each column the sum and the last value."""
    found = {}
    for name in ["lift", "wipe/panda", "handover/panda_panda"]:
        with h5py.File(wheel / f"robosuite/models/assets/demonstrations/{name}/demo.hdf5") as file:
            def visit(path, item):
                if isinstance(item, h5py.Dataset) and item.ndim and item.dtype.kind in "fiub":
                    values = item[()].astype(float).reshape(item.shape[0], -1)
                    found[f"{name.split('/')[0]}.hdf5/{path}"] = [item.shape, *(" ".join(repr(float(x)) for x in row) for row in [values.sum(axis=0), values[-1]])]
            file.visititems(visit)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robosuite", type=Path, default=Path(sys.prefix) / f"lib/python3.{sys.version_info.minor}/site-packages")
    wheel = parser.parse_args().robosuite
    FOLDER.mkdir(parents=True, exist_ok=True)
    found = {}
    for make, recordings in [(robomimic, {"data/demo_0": 6, "data/demo_2": 5, "data/demo_10": 4}), (isaac, {"data/demo_0": 5}), (aloha, {"": 4}), (egodex, {"": 4}), (user_block, {"data/demo_0": 4})]:
        path = FOLDER / f"{make.__name__}.hdf5"
        make(path)
        with h5py.File(path) as file:
            for recording, rows in recordings.items():
                log = f"{path.name}#{recording.split('/')[-1]}" if recording else path.name
                found[log] = expected(file[recording] if recording else file, rows)
    found["floats.hdf5"] = floats(FOLDER / "floats.hdf5")
    found["matlab.mat"] = matlab(FOLDER / "matlab.mat")
    demo(ROOT / "demos/robosuite/lift.hdf5", wheel)
    links(FOLDER.parent / "links")
    bodies = robosuite_lift(FOLDER / "robosuite_lift.hdf5", wheel)
    with h5py.File(FOLDER / "robosuite_lift.hdf5") as file:
        found["robosuite_lift.hdf5#demo_1"] = {**expected(file["data/demo_1"], 25), **bodies}
    # Numbers as texts: readers of JSON round.
    texts = {log: {title: " ".join(map(repr, column)) for title, column in columns.items()} for log, columns in found.items()}
    (FOLDER / "expected.json").write_text(json.dumps(texts, indent=0) + "\n")
    (FOLDER / "robosuite.json").write_text(json.dumps(sums(wheel)) + "\n")


if __name__ == "__main__":
    main()
