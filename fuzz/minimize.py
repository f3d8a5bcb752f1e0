#!/usr/bin/env python3
"""Makes fuzz/minimized/TARGET.zip of fuzz/corpus/TARGET: the inputs that reach most branches for their bytes, until the archive is full.

`fuzz/minimize.py [TARGET…]`, once `fuzz/run.sh` has built the targets. `fuzz/seeds.py` unpacks the archives into the corpora.
"""

import subprocess
import sys
import tempfile
import zipfile
import zlib
from pathlib import Path

FUZZ = Path(__file__).resolve().parent
# Bytes of an archive, of an input in it, and of what an archive notes of an input.
MOST, LONGEST, NOTES = 38_000, 16_000, 85
# Folders of this machine may be in what a fuzzer kept.
PRIVATE = [str(folder).encode() for folder in (FUZZ.parent, Path.home(), "/home/")]


def reached(target):
    """The inputs of a corpus, shortest first, with how much each reaches that those before it do not: branches, and how often they were taken."""
    binary = next((FUZZ / "target").glob(f"*/release/{target}"))
    with tempfile.TemporaryDirectory() as folder:
        control, into = Path(folder, "control"), Path(folder, "into")
        into.mkdir()
        options = ["-merge=1", f"-merge_control_file={control}", "-max_len=100000", "-timeout=20", "-rss_limit_mb=4096", f"-artifact_prefix={folder}/"]
        subprocess.run([binary, *options, into, FUZZ / "corpus" / target], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
        count, _, *lines = control.read_text().splitlines()
        paths = [Path(line) for line in lines[: int(count)]]
        for line in lines[int(count) :]:
            kind, number, *features = line.split()
            if kind == "FT":
                yield paths[int(number)].read_bytes(), len(features)


def chosen(inputs):
    """The inputs that fit, those first that add most for each byte of the archive; and the share of what all reach."""
    sized = [(content, len(zlib.compress(content, 9)) + NOTES, new) for content, new in inputs]
    left, kept, seen = MOST, [], 0
    for content, size, new in sorted(sized, key=lambda one: -one[2] / one[1]):
        if new and size <= left and len(content) <= LONGEST and not any(word in content for word in PRIVATE):
            kept.append(content)
            left -= size
            seen += new
    return kept, seen / max(1, sum(new for *_, new in sized))


def main():
    (FUZZ / "minimized").mkdir(exist_ok=True)
    print("| target | inputs | bytes | of what the whole corpus reaches, at least |\n|---|---|---|---|")
    for target in sys.argv[1:] or sorted(path.stem for path in (FUZZ / "fuzz_targets").glob("*.rs")):
        kept, share = chosen(reached(target))
        path = FUZZ / "minimized" / f"{target}.zip"
        with zipfile.ZipFile(path, "w") as archive:
            for at, content in enumerate(kept):
                # The same time in each, so that the same inputs are the same archive.
                archive.writestr(zipfile.ZipInfo(f"{at:03}"), content, zipfile.ZIP_DEFLATED, 9)
        print(f"| {target} | {len(kept)} | {path.stat().st_size:,} | {share:.0%} |", flush=True)


main()
