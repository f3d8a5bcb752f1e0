"""Measures how long after a row was sent its label arrives, over two WebSockets of this machine: docs/measurements/live.md.

    python3 tools/measure_live_latency.py target/release/teachtree pick_and_place --rules prompt.rules --seconds 120

A simulated recording is published row by row, at its own pace and again and again, as JSON by a server of the Foxglove protocol; `teachtree live` follows it and
serves events; a third process reads them. Both ends are made with the package `websockets`. Printed are the times between the sending of the row whose stamp a
label has and the arrival of the label.
"""

import argparse
import asyncio
import csv
import json
import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import time

import websockets

BEGIN_NS = 1_700_000_000_000_000_000
PROTOCOL = "foxglove.sdk.v1"
# The calibration of `live`, in which nothing is labeled, s.
CALIBRATION_S = 3.0


def is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def recorded(program: str, scene: str, folder: pathlib.Path) -> None:
    """Teaches a scene, writes its columns of numbers to `rows.csv`, and a binding of the topic `/rows`."""
    subprocess.run([program, "teach", scene, scene, "--seed", "1", "-o", folder / "log.csv"], check=True, stdout=subprocess.DEVNULL)
    titles, *rows = csv.reader((folder / "log.csv").open())
    kept = [at for at, _ in enumerate(titles) if all(is_number(row[at]) for row in rows)]
    with (folder / "rows.csv").open("w", newline="") as file:
        csv.writer(file).writerows([[row[at] for at in kept] for row in [titles, *rows]])
    channels: dict[str, list[str]] = {}
    for title in (titles[at] for at in kept if not titles[at].startswith("time ")):
        name, _, unit = title.partition(" ")
        channel, _, component = name.rpartition(".")
        channels.setdefault(channel if component in "wxyz" else name, []).append(f"/rows.{name.replace('.', '_')} {unit}".strip())
    columns = [f"  {name}: {json.dumps(columns) if len(columns) > 1 else columns[0]}" for name, columns in channels.items()]
    rate = round(1 / (float(rows[1][0]) - float(rows[0][0])))
    lines = ["about: rows of a simulated robot", f"resample: {rate} Hz", "channels:", *columns]
    (folder / "cell.binding.yaml").write_text("\n".join(lines) + "\n")


async def publish(folder: pathlib.Path, port: int, seconds: float) -> None:
    """Serves the rows to the first that subscribes, each at its time, and writes when each was sent."""
    titles, *rows = csv.reader((folder / "rows.csv").open())
    keys = [title.split(" ")[0].replace(".", "_") for title in titles]
    step = float(rows[1][0]) - float(rows[0][0])
    bodies = [", ".join(f'"{key}": {cell}' for key, cell in list(zip(keys, row))[1:]) for row in rows]
    sent, done = [], asyncio.Event()

    async def serve(socket: websockets.ServerConnection) -> None:
        channel = {"id": 1, "topic": "/rows", "encoding": "json", "schemaName": "", "schema": "", "schemaEncoding": ""}
        head = {"op": "serverInfo", "name": "robot", "capabilities": [], "supportedEncodings": ["json"], "metadata": {}, "sessionId": "1"}
        await socket.send(json.dumps(head))
        await socket.send(json.dumps({"op": "advertise", "channels": [channel]}))
        subscription = json.loads(await socket.recv())["subscriptions"][0]["id"]
        start = time.monotonic()
        for at in range(int(seconds / step)):
            left = start + at * step - time.monotonic()
            if left > 0.0002:
                await asyncio.sleep(left - 0.0001)
            while time.monotonic() < start + at * step:
                pass
            stamp_ns = BEGIN_NS + round(at * step * 1e9)
            stamp = '"header": {"stamp": {"sec": %d, "nanosec": %d}}' % divmod(stamp_ns, 10**9)
            sent.append((round(at * step, 4), time.time_ns()))
            text = f"{{{stamp}, {bodies[at % len(bodies)]}}}"
            await socket.send(struct.pack("<BIQ", 1, subscription, stamp_ns) + text.encode())
        await asyncio.sleep(1)
        done.set()

    async with websockets.serve(serve, "127.0.0.1", port, subprotocols=[PROTOCOL], compression=None):
        print("serving", flush=True)
        await done.wait()
    (folder / "sent.json").write_text(json.dumps(sent))


async def read(folder: pathlib.Path, port: int) -> None:
    """Reads the events until the server ends, and writes when each label came."""
    labels = []
    async with websockets.connect(f"ws://127.0.0.1:{port}", subprotocols=[PROTOCOL], compression=None) as events:
        try:
            async for message in events:
                now = time.time_ns()
                if isinstance(message, bytes):
                    event = json.loads(message[13:])
                    if event["event"] == "label":
                        labels.append((round(event["time_s"], 4), now))
                elif (said := json.loads(message))["op"] == "advertise":
                    asked = [channel["id"] for channel in said["channels"] if channel["topic"] == "/teachtree/events"]
                    await events.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": one, "channelId": one} for one in asked]}))
        except websockets.ConnectionClosed:
            pass
    (folder / "labels.json").write_text(json.dumps(labels))


def measure(program: str, scene: str, rules: str, seconds: float, ports: tuple[int, int]) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        recorded(program, scene, folder)
        own = [sys.executable, __file__]
        robot = subprocess.Popen([*own, "--publish", folder, str(ports[0]), str(seconds)], stdout=subprocess.PIPE)
        robot.stdout.readline()
        source = [f"ws://127.0.0.1:{ports[0]}", "--binding", folder / "cell.binding.yaml", "--scene", folder / "log.scene.yaml", "--rules", rules]
        sink = ["--serve", str(ports[1]), "--format", "json", "--calibrate", str(CALIBRATION_S)]
        live = subprocess.Popen([program, "live", *source, *sink], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        said = live.stderr.readline().decode()
        if not said.startswith("serving"):
            robot.kill()
            sys.exit(said + live.stderr.read().decode())
        reader = subprocess.Popen([*own, "--read", folder, str(ports[1])])
        robot.wait()
        live.send_signal(signal.SIGINT)
        live.wait()
        reader.wait()
        sent = dict(json.loads((folder / "sent.json").read_text()))
        # What the calibration holds back comes at once when it is over.
        came = [(stamp, at) for stamp, at in json.loads((folder / "labels.json").read_text()) if stamp > CALIBRATION_S + 0.2]
        late = sorted((at - sent[stamp]) * 1e-6 for stamp, at in came if stamp in sent)
        if not late:
            sys.exit(f"no label came: {live.stderr.read().decode()}")
        shares = ", ".join(f"{share:.0%} {late[min(int(share * len(late)), len(late) - 1)]:.2f}" for share in (0.5, 0.95, 0.99))
        within = sum(one <= 5 for one in late) / len(late)
        print(f"{rules}, {scene}: {len(late)} labels; {shares}, most {late[-1]:.2f} ms; {within:.1%} within 5 ms")


def main() -> None:
    if sys.argv[1:2] == ["--publish"]:
        asyncio.run(publish(pathlib.Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])))
    elif sys.argv[1:2] == ["--read"]:
        asyncio.run(read(pathlib.Path(sys.argv[2]), int(sys.argv[3])))
    else:
        asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
        asked.add_argument("program")
        asked.add_argument("scene", help="a shipped scene, which is also the name of its operator")
        asked.add_argument("--rules", default="prompt.rules")
        asked.add_argument("--seconds", type=float, default=60.0)
        asked.add_argument("--ports", type=int, nargs=2, default=(18765, 18766))
        given = asked.parse_args()
        measure(given.program, given.scene, given.rules, given.seconds, tuple(given.ports))


if __name__ == "__main__":
    main()
