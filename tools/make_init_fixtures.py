"""Writes tests/fixtures/init: one scripted motion in the layouts of other programs, for the tests of `teachtree init`.

A gripper takes a cube of 40 mm from a table, carries it and puts it down: closed from 3.5 s to 9 s. Needs h5py, numpy, pyarrow, zarr, mcap and mcap-ros2-support.
"""

import json
import pathlib
import shutil

import h5py
import numpy
import pyarrow
import pyarrow.parquet
import zarr
from mcap_ros2.writer import Writer

ROOT = pathlib.Path(__file__).parent.parent / "tests/fixtures/init"
RATE = 20.0
TIME = numpy.arange(0, 12, 1 / RATE)
WAYPOINTS = [
    (0.0, (0.30, -0.20, 0.25)),
    (2.0, (0.40, 0.10, 0.20)),
    (3.0, (0.40, 0.10, 0.02)),
    (3.8, (0.40, 0.10, 0.02)),
    (5.0, (0.40, 0.10, 0.20)),
    (7.0, (0.30, 0.30, 0.20)),
    (8.5, (0.30, 0.30, 0.02)),
    (9.3, (0.30, 0.30, 0.02)),
    (10.5, (0.30, 0.30, 0.25)),
    (12.0, (0.30, 0.00, 0.25)),
]
TCP = numpy.stack([numpy.interp(TIME, [at for at, _ in WAYPOINTS], [point[axis] for _, point in WAYPOINTS]) for axis in range(3)], 1)
WIDTH = numpy.interp(TIME, [0, 3.2, 3.5, 9.0, 9.3, 12], [0.08, 0.08, 0.04, 0.04, 0.08, 0.08])
HELD = (TIME > 3.5) & (TIME <= 9.0)
CUBE = numpy.where(TIME[:, None] <= 3.5, [0.40, 0.10, 0.02], numpy.where(HELD[:, None], TCP, [0.30, 0.30, 0.02]))
YAW = numpy.full_like(TIME, 0.3)
NOUGHT = numpy.zeros_like(TIME)
CUBE_XYZW = numpy.stack([NOUGHT, NOUGHT, numpy.sin(YAW / 2), numpy.cos(YAW / 2)], 1)
DOWN_XYZW = numpy.tile([1.0, 0.0, 0.0, 0.0], (len(TIME), 1))
LIFTED = HELD & (CUBE[:, 2] > 0.021)
NOISE = numpy.random.default_rng(1).normal(0, 0.02, (len(TIME), 3))
FORCE = NOISE + numpy.stack([NOUGHT, NOUGHT, numpy.where(LIFTED, 2.943, 0.0)], 1)
JOINTS = numpy.stack([numpy.sin(0.3 * TIME + joint) for joint in range(6)], 1)
# Shares of a gripper that is closed at its lower end.
SHARE = (WIDTH - 0.04) / 0.04 * 0.9 + 0.05


def hdf5(name, write):
    with h5py.File(ROOT / name, "w") as file:
        write(file)


def put(group, name, values):
    group.create_dataset(name, data=numpy.asarray(values, numpy.float32), compression="gzip")


def robomimic(file):
    data = file.create_group("data")
    data.attrs["env_args"] = json.dumps({"env_name": "Lift", "type": 1, "env_kwargs": {}})
    for demo in ("demo_0", "demo_1"):
        one = data.create_group(demo)
        one.attrs["num_samples"] = len(TIME)
        put(one, "actions", numpy.concatenate([numpy.gradient(TCP, axis=0), numpy.zeros((len(TIME), 3)), numpy.sign(0.06 - WIDTH)[:, None]], 1))
        obs = one.create_group("obs")
        put(obs, "robot0_eef_pos", TCP)
        put(obs, "robot0_eef_quat", DOWN_XYZW)
        put(obs, "robot0_gripper_qpos", numpy.stack([WIDTH / 2, -WIDTH / 2], 1))
        put(obs, "robot0_gripper_qvel", numpy.stack([numpy.gradient(WIDTH), -numpy.gradient(WIDTH)], 1))
        put(obs, "robot0_joint_pos", JOINTS)
        put(obs, "object", numpy.concatenate([CUBE, CUBE_XYZW, CUBE - TCP], 1))


def libero(file):
    one = file.create_group("data").create_group("demo_0")
    put(one, "actions", numpy.zeros((len(TIME), 7)))
    obs = one.create_group("obs")
    put(obs, "ee_pos", TCP)
    put(obs, "ee_ori", numpy.tile([3.14, 0.0, 0.0], (len(TIME), 1)))
    put(obs, "ee_states", numpy.concatenate([TCP, numpy.tile([3.14, 0.0, 0.0], (len(TIME), 1))], 1))
    put(obs, "gripper_states", numpy.stack([WIDTH / 2, -WIDTH / 2], 1))
    put(obs, "joint_states", JOINTS)


def vx300s(points):
    """The joints of an arm of ALOHA whose gripper points down at these points in the frame of its base, by the lengths of robots/vx300s.urdf."""
    x, y, z = points.T
    upper, fore, tip = numpy.hypot(0.05955, 0.3), 0.3, 0.069744 + 0.1072
    tilt = numpy.arctan2(0.3, 0.05955)
    reach, height = numpy.hypot(x, y), z + tip - 0.12705
    far = numpy.hypot(reach, height)
    rise = numpy.arctan2(height, reach) + numpy.arccos((upper**2 + far**2 - fore**2) / (2 * upper * far))
    fall = -numpy.arctan2(height - upper * numpy.sin(rise), reach - upper * numpy.cos(rise))
    shoulder = tilt - rise
    return numpy.stack([numpy.arctan2(y, x), shoulder, fall - shoulder, NOUGHT, numpy.pi / 2 - fall, NOUGHT], 1)


def aloha(file):
    """The right arm moves, the left one rests."""
    observations = file.create_group("observations")
    arm = numpy.concatenate([vx300s(TCP), SHARE[:, None]], 1)
    rest = numpy.tile([0.0, -0.96, 1.16, 0.0, -0.3, 0.0, 0.95], (len(TIME), 1))
    put(observations, "qpos", numpy.concatenate([rest, arm], 1))
    put(observations, "qvel", numpy.concatenate([rest * 0.0, numpy.gradient(arm, axis=0) * RATE], 1))
    put(file, "action", numpy.concatenate([rest, arm], 1))


def table(name, columns):
    keys = list(columns)
    rows = [",".join(keys)] + [",".join(f"{columns[key][row]:.5f}".rstrip("0").rstrip(".") for key in keys) for row in range(len(TIME))]
    (ROOT / name).write_text("\n".join(rows) + "\n")


def ur():
    columns = {"timestamp": TIME + 5120}
    for joint in range(6):
        columns[f"target_q_{joint}"] = JOINTS[:, joint]
        columns[f"actual_q_{joint}"] = JOINTS[:, joint]
    pose = numpy.concatenate([TCP, numpy.tile([0.0, 3.14, 0.02], (len(TIME), 1))], 1)
    force = numpy.concatenate([FORCE * [1, 1, -1], NOISE * 0.1], 1)
    for axis in range(6):
        columns[f"actual_TCP_pose_{axis}"] = pose[:, axis]
        columns[f"target_TCP_pose_{axis}"] = pose[:, axis]
        columns[f"actual_TCP_speed_{axis}"] = numpy.gradient(pose[:, axis]) * RATE
        columns[f"actual_TCP_force_{axis}"] = force[:, axis]
    return columns


def franka():
    columns = {"time": TIME}
    transform = numpy.zeros((len(TIME), 16))
    transform[:, 0], transform[:, 5], transform[:, 10], transform[:, 15] = 1, -1, -1, 1
    transform[:, 12:15] = TCP
    for at in range(16):
        columns[f"O_T_EE[{at}]"] = transform[:, at]
    wrench = numpy.concatenate([FORCE, NOISE * 0.1], 1)
    for at in range(6):
        columns[f"O_F_ext_hat_K[{at}]"] = wrench[:, at]
    for at in range(6):
        columns[f"q[{at}]"] = JOINTS[:, at]
    columns["gripper_width"] = WIDTH
    return columns


def optitrack():
    """A take of Motive: bodies `gripper` and `cube`, m, y up."""
    names = ["gripper"] * 7 + ["cube"] * 7
    head = [
        ["Format Version", "1.23", "Take Name", "take", "Capture Frame Rate", f"{RATE:.6f}", "Export Frame Rate", f"{RATE:.6f}", "Rotation Type", "Quaternion", "Length Units", "Meters", "Coordinate Space", "Global"],
        [],
        ["", "Type"] + ["Rigid Body"] * 14,
        ["", "Name"] + names,
        ["", "ID"] + ["1"] * 7 + ["2"] * 7,
        ["", ""] + (["Rotation"] * 4 + ["Position"] * 3) * 2,
        ["Frame", "Time (Seconds)"] + ["X", "Y", "Z", "W", "X", "Y", "Z"] * 2,
    ]

    def upright(points):
        return numpy.stack([points[:, 0], points[:, 2], -points[:, 1]], 1)

    rows = []
    for row, (tool, cube) in enumerate(zip(upright(TCP), upright(CUBE))):
        values = [0, 0, 0, 1, *tool, 0, numpy.sin(0.15), 0, numpy.cos(0.15), *cube]
        rows.append([str(row), f"{TIME[row]:.6f}"] + [f"{value:.6f}" for value in values])
    (ROOT / "optitrack.csv").write_text("\n".join(",".join(line) for line in head + rows) + "\n")


def lerobot(name, version):
    names = [f"{joint}.pos" for joint in ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")]
    state = numpy.concatenate([JOINTS[:, :5] * 60, SHARE[:, None] * 100], 1).astype(numpy.float32)
    flat = pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(state.ravel()), 6)
    count = pyarrow.array(numpy.arange(len(TIME)))
    frame = pyarrow.table({
        "observation.state": flat,
        "action": flat,
        "timestamp": pyarrow.array(TIME.astype(numpy.float32)),
        "frame_index": count,
        "episode_index": pyarrow.array(numpy.zeros(len(TIME), numpy.int64)),
        "index": count,
        "task_index": pyarrow.array(numpy.zeros(len(TIME), numpy.int64)),
    })
    feature = {"dtype": "float32", "shape": [6], "names": names}
    one = {"dtype": "int64", "shape": [1], "names": None}
    features = {"observation.state": feature, "action": feature, "timestamp": {**one, "dtype": "float32"}}
    features |= {key: one for key in ("frame_index", "episode_index", "index", "task_index")}
    v3 = version == "v3.0"
    data = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet" if v3 else "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
    info = {"codebase_version": version, "robot_type": "so101_follower", "total_episodes": 1, "total_frames": len(TIME), "total_tasks": 1, "chunks_size": 1000, "fps": int(RATE), "splits": {"train": "0:1"}, "data_path": data, "video_path": None, "features": features}
    root = ROOT / name
    (root / "data/chunk-000").mkdir(parents=True)
    (root / "meta").mkdir()
    (root / "meta/info.json").write_text(json.dumps(info, indent=1) + "\n")
    if v3:
        pyarrow.parquet.write_table(frame, root / "data/chunk-000/file-000.parquet")
        (root / "meta/episodes/chunk-000").mkdir(parents=True)
        episodes = pyarrow.table({"episode_index": [0], "tasks": [["pick the cube"]], "length": [len(TIME)], "data/chunk_index": [0], "data/file_index": [0], "dataset_from_index": [0], "dataset_to_index": [len(TIME)]})
        pyarrow.parquet.write_table(episodes, root / "meta/episodes/chunk-000/file-000.parquet")
        pyarrow.parquet.write_table(pyarrow.table({"task_index": [0], "__index_level_0__": ["pick the cube"]}), root / "meta/tasks.parquet")
    else:
        pyarrow.parquet.write_table(frame, root / "data/chunk-000/episode_000000.parquet")
        (root / "meta/episodes.jsonl").write_text(json.dumps({"episode_index": 0, "tasks": ["pick the cube"], "length": len(TIME)}) + "\n")
        (root / "meta/tasks.jsonl").write_text(json.dumps({"task_index": 0, "task": "pick the cube"}) + "\n")


HEADER = "std_msgs/Header header\n"
SEPARATOR = "=" * 80
STAMP = f"{SEPARATOR}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{SEPARATOR}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
VECTOR = f"{SEPARATOR}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
POSE = f"{SEPARATOR}\nMSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n{SEPARATOR}\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n{SEPARATOR}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
WRENCH = f"{SEPARATOR}\nMSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"


def bag():
    with open(ROOT / "bag.mcap", "wb") as file:
        writer = Writer(file)
        joints = writer.register_msgdef("sensor_msgs/msg/JointState", f"{HEADER}string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n{STAMP}")
        wrench = writer.register_msgdef("geometry_msgs/msg/WrenchStamped", f"{HEADER}geometry_msgs/Wrench wrench\n{STAMP}{WRENCH}{VECTOR}")
        pose = writer.register_msgdef("geometry_msgs/msg/PoseStamped", f"{HEADER}geometry_msgs/Pose pose\n{STAMP}{POSE}")
        for row, time in enumerate(TIME):
            stamp_ns = int((1_700_000_000 + time) * 1e9)
            header = {"stamp": {"sec": stamp_ns // 10**9, "nanosec": stamp_ns % 10**9}, "frame_id": "base_link"}

            def xyz(values):
                return dict(zip("xyz", map(float, values)))

            def placed(point, turn):
                return {"header": header, "pose": {"position": xyz(point), "orientation": dict(zip("xyzw", map(float, turn)))}}

            names = [f"joint_{joint + 1}" for joint in range(6)] + ["left_finger_joint", "right_finger_joint"]
            positions = [*map(float, JOINTS[row]), float(WIDTH[row] / 2), float(WIDTH[row] / 2)]
            for topic, schema, message in (
                ("/joint_states", joints, {"header": header, "name": names, "position": positions, "velocity": [], "effort": []}),
                ("/wrench", wrench, {"header": header, "wrench": {"force": xyz(FORCE[row]), "torque": xyz(NOISE[row] * 0.1)}}),
                ("/ee_pose", pose, placed(TCP[row], DOWN_XYZW[row])),
                ("/cube/pose", pose, placed(CUBE[row], CUBE_XYZW[row])),
            ):
                writer.write_message(topic=topic, schema=schema, message=message, log_time=stamp_ns, publish_time=stamp_ns, sequence=row)
        writer.finish()


def diffusion_policy():
    root = zarr.open_group(str(ROOT / "replay.zarr"), mode="w", zarr_format=2)
    arrays = {
        "robot0_eef_pos": TCP,
        "robot0_eef_rot_axis_angle": numpy.tile([3.14, 0.0, 0.0], (len(TIME), 1)),
        "robot0_gripper_width": WIDTH[:, None],
        "action": numpy.concatenate([TCP, WIDTH[:, None]], 1),
    }
    for name, values in arrays.items():
        root.create_array(f"data/{name}", data=values.astype(numpy.float32))
    root.create_array("meta/episode_ends", data=numpy.array([len(TIME)], numpy.int64))


def main():
    shutil.rmtree(ROOT, ignore_errors=True)
    ROOT.mkdir(parents=True)
    hdf5("robomimic.hdf5", robomimic)
    hdf5("libero.hdf5", libero)
    hdf5("aloha.hdf5", aloha)
    table("ur_rtde.csv", ur())
    table("franka.csv", franka())
    optitrack()
    lerobot("lerobot_v21", "v2.1")
    lerobot("lerobot_v30", "v3.0")
    bag()
    diffusion_policy()


main()
