#!/usr/bin/env python3
"""Makes the seeds of the fuzz targets from the files of this repository: fuzz/corpus/TARGET/*, and fuzz/dictionaries/TARGET.

Inputs that earlier runs found (fuzz/minimized/TARGET.zip, made by `fuzz/minimize.py`) are added to the corpora.
"""

import json
import re
import struct
import zipfile
from itertools import chain
from pathlib import Path

FUZZ = Path(__file__).resolve().parent
ROOT = FUZZ.parent
LARGEST = 100_000
BETWEEN = "\n=====\n"


def files(*patterns):
    found = chain.from_iterable(sorted(ROOT.glob(pattern)) for pattern in patterns)
    return [path for path in found if path.is_file() and path.stat().st_size <= LARGEST]


def put(target, contents):
    folder = FUZZ / "corpus" / target
    folder.mkdir(parents=True, exist_ok=True)
    for at, content in enumerate(contents):
        (folder / f"seed-{at}").write_bytes(content if isinstance(content, bytes) else content.encode())


def copies(target, *patterns):
    found = files(*patterns)
    assert found, patterns
    put(target, (path.read_bytes() for path in found))


def cut(pattern, lines):
    """The beginnings of long tables."""
    return ["\n".join(path.read_text().splitlines()[:lines]) + "\n" for path in sorted(ROOT.glob(pattern))]


def tree(target, folder):
    """Each file of a folder, behind the byte that chooses it."""
    paths = sorted(path for path in (ROOT / folder).rglob("*") if path.is_file())
    put(target, [bytes([at]) + path.read_bytes() for at, path in enumerate(paths)])


def dictionary(target, words):
    folder = FUZZ / "dictionaries"
    folder.mkdir(exist_ok=True)
    escaped = sorted({word for word in words if word.isascii() and word.isprintable() and '"' not in word and "\\" not in word})
    (folder / target).write_text("".join(f'"{word}"\n' for word in escaped))


def keys(schema):
    """The names that a schema has."""
    found = re.findall(r'"([a-z_]+)": [{\[]', (ROOT / "schemas" / schema).read_text())
    return [f"{key}: " for key in found] + ["[1, 0, 0, 0]", "10 mm", "1e308 m", "-0.0", "nan", ".inf", "&a ", "*a", "<<: "]


def jsonl(path):
    titles, *rows = path.read_text().splitlines()
    names = [title.split(" [")[0] for title in titles.split(",")]
    lines = [json.dumps(dict(zip(names, map(float, row.split(","))))) for row in rows]
    scene = {"scene": {"bodies": {"cube": {"role": "object", "radius": "60 mm"}}}}
    return "\n".join([json.dumps(scene), *lines]) + "\n"


def rosbag():
    """A bag of ROS 1 with two messages in a chunk that is not compressed."""

    def record(fields, data):
        parts = b"".join(struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value for name, value in fields)
        return struct.pack("<I", len(parts)) + parts + struct.pack("<I", len(data)) + data

    definition = b"Header header\nfloat64 force\nint8[] pad\ntime when\n====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    fields = [b"type=my_msgs/Force", b"message_definition=" + definition]
    connection = b"".join(struct.pack("<I", len(field)) + field for field in fields)
    inner = record([(b"op", b"\x07"), (b"conn", bytes(4)), (b"topic", b"/force")], connection)
    for row in range(2):
        data = struct.pack("<IIII5sdI2bII", row, 100, row * 10_000_000, 5, b"wrist", row, 2, 1, -1, 7, 0)
        inner += record([(b"op", b"\x02"), (b"conn", bytes(4)), (b"time", struct.pack("<II", 9, row))], data)
    chunk = record([(b"op", b"\x05"), (b"compression", b"none"), (b"size", struct.pack("<I", len(inner)))], inner)
    return b"#ROSBAG V2.0\n" + record([(b"op", b"\x03")], b" " * 40) + chunk


def npy(shape, descr, data):
    header = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


def messages(*parts):
    at = {"textDocument": {"uri": "file:///a.rules"}, "position": {"line": 9, "character": 12}}
    text = (ROOT / "tests/fixtures/language/single_hand.rules").read_text()
    opened = {"textDocument": {"uri": "file:///a.rules", "languageId": "teachtree", "version": 1, "text": text}}
    sent = [("initialize", {"rootUri": None}, 1), ("initialized", {}, None), ("textDocument/didOpen", opened, None)]
    sent += [(f"textDocument/{part}", at | {"context": {"includeDeclaration": True, "diagnostics": []}, "newName": "other", "range": {"start": at["position"], "end": at["position"]}}, number) for number, part in enumerate(parts, 2)]
    sent += [("shutdown", None, 99), ("exit", None, None)]
    lines = [{"jsonrpc": "2.0", "method": method, "params": params} | ({"id": number} if number else {}) for method, params, number in sent]
    return "\n".join(map(json.dumps, lines))


def requests():
    def get(path):
        return f"GET /TOKEN/{path} HTTP/1.1\r\nHost: HOST\r\n\r\n"

    def post(path, body):
        body = json.dumps(body)
        return f"POST /TOKEN/{path} HTTP/1.1\r\nHost: HOST\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n{body}"

    line = {"track": "right", "kind": "primitive", "label": "Grasp", "start_s": 0.1, "end_s": 0.2, "pinned": True}
    place = {"files": {}, "file": "contact.rules", "line": 3, "character": 4}
    paths = ["", "studio.js", "api/list", "api/list?from=0&to=9&sort=name", "api/fit", "api/recording/0", "api/recording/0/labels", "api/recording/0/rules",
             "api/recording/0/explain?at=0.1&track=right", "video/0/0", "%2e%2e/%2e%2e/etc/passwd"]
    posts = [("api/recording/0/labels", {"base": "", "lines": [line]}), ("api/recording/0/params", {"touch_on": 0.2}), ("api/rules", {}),
             ("api/recording/0/rules", {"version": 0, "files": {"contact.rules": "use \"single_hand.rules\""}}), ("api/recording/0/rules/hover", place),
             ("api/recording/0/rules/complete", place), ("api/recording/0/fit", {}), ("api/recording/0/export/elan", {"replace": True})]
    ranged = "GET /TOKEN/video/0/0 HTTP/1.1\r\nHost: HOST\r\nRange: bytes=5-9\r\nConnection: close\r\nOrigin: http://HOST\r\n\r\n"
    return [get(path) for path in paths] + [post(*one) for one in posts] + [ranged]


RULES = ["rules/*.rules", "examples/**/*.rules", "tests/fixtures/graphs/*.rules", "tests/fixtures/language/*.rules", "tests/fixtures/diagnostics/*.rules"]
copies("rules", *RULES)
texts = [path.read_text() for path in files("rules/*.rules", "examples/*.rules", "tests/fixtures/graphs/*.rules", "tests/fixtures/language/*.rules")]
put("pairs", [one + BETWEEN + other for one, other in zip(texts, texts[1:] + texts[:1])] + [text + BETWEEN + text for text in texts])
words = re.findall(r'"([^"]+)"', "".join(path.read_text() for path in files("grammar/*.pest")))
units = ["10 ms", "0.5 s", "1 N", "5 mm", "1e300 m", " and ", " or ", "not ", "use \"contact.rules\"", "right.thumb.force", "object.velocity"]
for target in ["rules", "pairs"]:
    dictionary(target, words + units)
asked = ["hover", "definition", "references", "prepareRename", "rename", "completion", "documentSymbol", "formatting", "codeAction"]
put("lsp", [messages(part) for part in asked] + [messages(*asked), "Content-Length: 2\r\n\r\n{}"])
dictionary("lsp", [f"textDocument/{part}" for part in asked] + ["initialize", "shutdown", "exit", "didChange", "workspace/didChangeConfiguration"])
put("expectations", [f"log: log.csv\nrules: contact.rules\nset: touch_on = 0.2 N\ntolerance: 50 ms\ntrack {who}\n  Move 0 .. 1.5\n  Grasp 1.5 .. 2 pinned\n  task push 0 .. 2\n" for who in ["left", "right", "both"]])
dictionary("expectations", ["log: ", "binding: ", "scene: ", "hand: ", "rules: ", "set: ", "tolerance: ", "track both", "task ", " .. ", "---", "pinned", "unknown"])

copies("bindings", "tests/fixtures/bindings/*.yaml", "demos/**/*.binding.yaml", "tests/fixtures/formats/*.binding.yaml")
copies("scenes", "scenes/*[!r].yaml", "demos/**/*.scene.yaml", "tests/fixtures/logs/box.yaml")
copies("operators", "scenes/*.operator.yaml", "examples/*.operator.yaml")
copies("robots", "robots/*.yaml", "tests/fixtures/robots/*.yaml")
copies("urdf", "tests/fixtures/*.urdf")
for target, schema in [("bindings", "binding"), ("scenes", "scene"), ("operators", "operator"), ("robots", "robot")]:
    dictionary(target, keys(f"{schema}.schema.json"))
dictionary("urdf", ["<link name=\"a\">".replace('"', "'"), "<joint ", "<inertial>", "<mimic joint='a' multiplier='2'/>", "<limit lower='-1' upper='1'/>", "type='prismatic'", "type='continuous'", "<axis xyz='0 0 1'/>", "<origin rpy='0 0 1' xyz='0 0 1'/>"])
pose = [0, 0, 0.1, 1, 0, 0, 0]
quality = {"jerk_before": 1, "jerk_after": 0, "position_deviation": 0, "force_deviation": 0, "into_cone": 0}
tip = {"finger": "thumb", "position": [[0, 0, 0]] * 2, "force": [[0, 0, 1]] * 2}
segment = {"primitive": "Translate", "does": "carry", "start_s": 0, "duration_s": 0.01, "demonstrated_start_s": 0, "grasp": 0, "touching": True,
    "object": [pose] * 2, "hand": [[0, 0, 0]] * 2, "tips": [tip], "quality": quality}
mapped = {"object_from_palm": pose, "joints": {"thumb_0": 0.1}, "criterion": "manipulability", "measure": 0.5, "friction_margin": 0.7, "copied_measure": None,
    "fingers": [{"finger": "thumb", "manipulability": 0.1, "freedom": 0.5, "pad_angle_deg": 3, "alignment": 1}]}
grasp = {"contacts": [{"finger": "thumb", "point": [0, 0, 0.05], "normal": [0, 0, 1]}], "mapped": mapped}
task = {"track": "right", "task": "push", "object": "cube", "start_s": 0, "end_s": 0.01, "grasps": [grasp], "segments": [segment],
    "into": {"body": "board", "pose": pose}, "left_out": [{"primitives": ["Grasp"], "start_s": 0, "end_s": 1, "why": "dropped"}]}
commanded = {"schema": "teachtree.commands/1", "log": "log.csv", "rate_hz": 100, "scene": "push"}
put("commands", [json.dumps(commanded | {"tasks": tasks}) for tasks in [[], [task], [task, task | {"track": "left"}]]])
put("labels", ["track,label,start_s,end_s\nright,Grasp,0,1\nright,push,1,2.5\n", "start_frame,end_frame,label\n0,10,Grasp\n11,99,Move\n", "log,start,end,label\nlog.csv,0,1,a\nother.csv,0,1,b\n",
    "<?xml version='1.0'?><ANNOTATION_DOCUMENT><TIME_ORDER><TIME_SLOT TIME_SLOT_ID='a' TIME_VALUE='0'/><TIME_SLOT TIME_SLOT_ID='b' TIME_VALUE='900'/></TIME_ORDER><TIER TIER_ID='right'><ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID='c' TIME_SLOT_REF1='a' TIME_SLOT_REF2='b'><ANNOTATION_VALUE>Grasp</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION></TIER></ANNOTATION_DOCUMENT>"])
columns = (ROOT / "tests/fixtures/logs/steady_grip.csv").read_text().split("\n")[0].split(",")[1:]
calibration = {"schema": "teachtree.calibration/1", "rate_hz": 100, "sensors": {"rests": {}, "levels": {}}, "columns": [column.split(" [")[0] for column in columns],
    "bodies": ["cube", "base"], "touches": {"0": {"pairs": [], "noise": None}}}
put("calibrations", [json.dumps(calibration), json.dumps(calibration | {"touches": {}, "rate_hz": 1000})])

copies("csv", "tests/fixtures/logs/*.csv", "tests/fixtures/bindings/foreign.csv")
put("qualisys", cut("demos/dfki_hand/*.tsv", 40) + cut("demos/dfki_hand/*.tsv", 14))
plain = [ROOT / "tests/fixtures/logs" / name for name in ["whole.csv", "steady_grip.csv", "gap.csv"]]
put("jsonl", [jsonl(path) for path in plain] + ['{"t": 1, "a": {"b": [1, 2], "b.c": null}}\n{"t": 2}\n', '{"scene": 1}\n'])
copies("mcap", "tests/fixtures/formats/rosbag2/*.mcap")
put("rosbag", [rosbag()])
copies("parquet", "tests/fixtures/**/*.parquet")
tree("lerobot", "tests/fixtures/formats/lerobot_v30")
copies("hdf5", "tests/fixtures/formats/**/*.hdf5")
copies("arrays", "tests/fixtures/formats/stores/*.np[yz]", "tests/fixtures/formats/stores/*.zip")
(FUZZ / "corpus/arrays/plain").write_bytes(npy((2, 2), "<f8", struct.pack("<4d", 0, 1, 2, 3)))
(FUZZ / "corpus/arrays/fields").write_bytes(npy((2,), [("time", "<f8"), ("a", ">i2", (2,))], bytes(24)))
tree("zarr", "tests/fixtures/formats/stores/demos_3_by_3.zarr")
changes = [[(9, 0, 1, 0.0)], [(5, 3, 0, 0.1), (7, 4, 2, 0.0)], [(9, 2, 3, -0.05)], [(9, 2, 5, 0.0), (20, 0, 7, 0.5)], [(1, 4, 4, 1.0)]]
put("rows", [b"".join(struct.pack("<BBBd", *change) for change in some) for some in changes])

advertised = {"op": "advertise", "channels": [{"id": 1, "topic": "/force", "encoding": "cdr", "schemaName": "a/F", "schemaEncoding": "ros2msg", "schema": "float64 x\nstring name\nuint8[] more\nB b\n====\nMSG: a/B\nfloat32[3] y\n"},
    {"id": 2, "topic": "/json", "encoding": "json", "schemaName": "j", "schema": "{}"}, {"id": 3, "topic": "/old", "encoding": "ros1", "schemaName": "a/O", "schema": "time t\nduration d\nbool[2] c\n"}]}
asks = [advertised, {"op": "unadvertise", "channelIds": [1]}, {"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 3}]}, {"op": "unsubscribe", "subscriptionIds": [0]}]
binary = b"\x01" + struct.pack("<IQ", 0, 10**18)
payloads = [bytes([0, 1, 0, 0]) + struct.pack("<dI4sI3B", 1.5, 4, b"abc\0", 3, 1, 2, 3) + bytes(13), b'{"a": {"b": 1, "c": [1, 2]}, "d": "x"}', bytes(18)]
put("foxglove", [b"\n".join(json.dumps(one).encode() for one in asks) + b"\n\n" + binary + payload for payload in payloads])
put("studio", requests())
palm = {"type": "palm", "hand": "right", "epoch": 0, "palm": [0, 0, 0.1, 1, 0, 0, 0], "closes": True, "squeeze": 0.5, "presses": False}
tips = {"type": "tips", "hand": "right", "epoch": 0, "tips": [[0, 0, 0.1]] * 4, "palm": None}
put("teaching", ["\n".join(map(json.dumps, some)) for some in [[palm], [tips], [{"type": "start"}, palm, {"type": "stop"}], [{"type": "undo"}, {"type": "reset"}], [{"type": "forces", "every_ms": 5}], [{"type": "robot", "take": 0}]]])

for path in sorted((FUZZ / "minimized").glob("*.zip")):
    with zipfile.ZipFile(path) as archive:
        archive.extractall(FUZZ / "corpus" / path.stem / "minimized")
