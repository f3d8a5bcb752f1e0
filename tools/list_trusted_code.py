"""Writes docs/measurements/dependencies.md: the packages that the crates name, and the dependencies that run code while they are built (build scripts,
procedural macros) or contain `unsafe`, with their auditors. The measurements of the crate mcap at the end of the page are constant.

    python3 tools/list_trusted_code.py > docs/measurements/dependencies.md                       # audits from their addresses
    python3 tools/list_trusted_code.py NAME=AUDITS.toml … > docs/measurements/dependencies.md    # audits from files

Dependencies of the program with its default features on Linux, without those of tests. `unsafe` is counted in sources, comments left out. A version is audited
where published audits of `cargo vet` lead to it: that of a whole version, and those of the differences after it.
"""

import json
import pathlib
import re
import subprocess
import sys
import tomllib
import urllib.request

RAW = "https://raw.githubusercontent.com"
AUDITS = {
    "Bytecode Alliance": f"{RAW}/bytecodealliance/wasmtime/main/supply-chain/audits.toml",
    "Google": f"{RAW}/google/rust-crate-audits/main/audits.toml",
    "Mozilla": f"{RAW}/mozilla/supply-chain/main/audits.toml",
}
# What must have been looked for. Google's criteria say how sure `unsafe` code is; 0 to 2 are accepted there.
ENOUGH = {"safe-to-deploy", "ub-risk-0", "ub-risk-1", "ub-risk-1-thorough", "ub-risk-2", "ub-risk-2-thorough"}

ROOT = pathlib.Path(__file__).parent.parent

# What each direct dependency does here; others are named by the one that brings them.
DOES = {
    "allocation-counter": "memory that readers allocate, in tests",
    "annotate-snippets": "draws compiler messages",
    "arrow-array": "features that the wheel needs",
    "arrow-ipc": "the schema in Parquet files",
    "arrow-schema": "the schema in Parquet files",
    "base64": "the schema in Parquet files",
    "bytes": "buffers of Parquet",
    "bzip2": "bags packed by bz2",
    "clap": "the command line",
    "clap_complete": "shell completions",
    "clap_mangen": "the manual page",
    "crc32fast": "checksums of MCAP",
    "csv": "CSV files",
    "ctrlc": "Ctrl-C removes temporary files",
    "fast-float2": "numbers in text logs",
    "flate2": "deflate in NPZ and Zarr",
    "getrandom": "tokens of local pages",
    "glob": "patterns of logs in `teachtree.yaml`",
    "hdf5-pure": "HDF5 files",
    "httparse": "requests to local pages",
    "indexmap": "tables in the order of their files",
    "indicatif": "progress bars",
    "insta": "snapshots, in tests",
    "libc": "opening files without blocking",
    "lsp-server": "the language server",
    "gen-lsp-types": "the language server",
    "lz4_flex": "lz4 in MCAP, bags and Zarr",
    "mcap": "bags by another writer, in tests",
    "memchr": "ends of lines in text logs",
    "mesh-loader": "meshes of robots",
    "nalgebra": "vectors and rotations",
    "npyz": "NumPy files",
    "once_cell": "features that the wheel needs",
    "parquet": "Parquet files",
    "parry3d-f64": "distances of shapes",
    "pest": "the grammar of rules",
    "pest_derive": "the grammar of rules",
    "proptest": "random inputs, in tests",
    "prost-reflect": "messages in protobuf",
    "pulp": "loops of the engine by processor",
    "rand": "simulated operators",
    "rand_chacha": "simulated operators",
    "rand_distr": "simulated operators",
    "rapier3d-f64": "the simulated environment",
    "rayon": "several recordings at once",
    "rcgen": "the certificate of local pages with TLS",
    "regex-lite": "groups of recordings by name",
    "ring": "the fingerprint of that certificate",
    "roxmltree": "URDF and other XML",
    "rusqlite": "ROS 2 bags in SQLite",
    "rustls": "TLS of local pages",
    "schemars": "schemas of YAML files",
    "serde": "types of YAML and JSON",
    "serde_json": "JSON",
    "serde_yaml": "YAML",
    "sha2": "digests of files and rules",
    "signal-hook": "SIGTERM like Ctrl-C",
    "similar": "patches",
    "syn": "features that the wheel needs",
    "tempfile": "temporary files beside outputs",
    "terminal_size": "width of the terminal",
    "tungstenite": "WebSockets",
    "zenoh": "live logs over Zenoh",
    "zip": "NPZ and zipped Zarr",
    "zstd": "zstd in MCAP and Zarr",
}

# Packages of features that are not on by default. Tests have these features, so `cargo metadata` lists them.
OPTIONAL = {"rcgen", "ring", "rustls", "zenoh"}


def metadata():
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", "x86_64-unknown-linux-gnu"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def used(metadata):
    """The ids that the program is made of, each with the direct dependencies that bring it."""
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    root = next(package["id"] for package in metadata["packages"] if package["name"] == "teachtree")
    names = {package["id"]: package["name"] for package in metadata["packages"]}

    def below(id):
        return [dep["pkg"] for dep in nodes[id]["deps"] if any(kind["kind"] in (None, "build") for kind in dep["dep_kinds"])]

    brings = {}
    own, todo = set(), [root]
    while todo:
        id = todo.pop()
        if id not in own:
            own.add(id)
            todo += [dep for dep in below(id) if names[dep].startswith("teachtree")]
    for direct in sorted({dep for id in own for dep in below(id)} - own):
        if names[direct] not in DOES:
            raise SystemExit(f"DOES in {__file__} lacks `{names[direct]}`")
        if names[direct] in OPTIONAL:
            continue
        open_ids = [direct]
        while open_ids:
            id = open_ids.pop()
            if names[direct] not in brings.setdefault(id, set()):
                brings[id].add(names[direct])
                open_ids.extend(below(id))
    return brings


def direct():
    """The packages that the manifests of the program and its crates name, each with the crates that do; in brackets if only their tests do."""
    manifests = [ROOT / "Cargo.toml", *sorted((ROOT / "crates").glob("*/Cargo.toml"))]
    renamed = tomllib.loads(manifests[0].read_text())["workspace"]["dependencies"]
    users = {}
    for manifest in manifests:
        parsed = tomllib.loads(manifest.read_text())
        tables = [parsed, *parsed.get("target", {}).values()]
        code = {name for table in tables for key in ("dependencies", "build-dependencies") for name in table.get(key, {})}
        for name in code | {name for table in tables for name in table.get("dev-dependencies", {})}:
            if not name.startswith("teachtree"):
                declared = renamed.get(name)
                package = declared.get("package", name) if isinstance(declared, dict) else name
                tests = name not in code
                crate = "the program" if manifest.parent == ROOT else manifest.parent.name
                users.setdefault(package, []).append(f"({crate})" if tests else crate)
    if lacking := sorted(set(users) - set(DOES)):
        raise SystemExit(f"DOES in {__file__} lacks {', '.join(lacking)}")
    return [f"| {package} | {DOES[package]} | {', '.join(users[package])} |" for package in sorted(users)]


def unsafe_count(package):
    folder = pathlib.Path(package["manifest_path"]).parent
    count = 0
    for file in (folder / "src").rglob("*.rs"):
        text = re.sub(r"//[^\n]*|/\*.*?\*/", "", file.read_text(errors="replace"), flags=re.S)
        count += len(re.findall(r"\bunsafe\b(?!_)", text))
    return count


def audits(texts):
    """The audits of each package: who audited, the version before or none, the version."""
    found = {}
    for who, text in texts.items():
        for package, entries in tomllib.loads(text).get("audits", {}).items():
            for entry in entries:
                criteria = entry.get("criteria", [])
                if not ENOUGH & set([criteria] if isinstance(criteria, str) else criteria):
                    continue
                of_package = found.setdefault(package, [])
                if "version" in entry:
                    of_package.append((who, None, entry["version"]))
                elif "delta" in entry:
                    before, after = (part.strip() for part in entry["delta"].split("->"))
                    of_package.append((who, before, after))
    return found


def auditors(audits, version):
    """Whose audits lead to a version; empty where none do."""
    reached = {None: set()}
    while True:
        further = next(((who, before, after) for who, before, after in audits if before in reached and after not in reached), None)
        if further is None:
            return ", ".join(sorted(reached.get(version, ())))
        who, before, after = further
        reached[after] = reached[before] | {who}


def audited(audits, version):
    """Who audited a version, or the last one that was audited."""
    if who := auditors(audits, version):
        return who
    others = {after for _, _, after in audits if auditors(audits, after)}
    last = max(others, key=lambda other: [int(part) for part in re.findall(r"\d+", other.split("@")[0])], default=None)
    return f"only {last}" if last else ""


def main(arguments):
    if arguments:
        texts = {name: pathlib.Path(file).read_text() for name, file in (argument.split("=", 1) for argument in arguments)}
    else:
        texts = {name: urllib.request.urlopen(address, timeout=60).read().decode() for name, address in AUDITS.items()}
    known = audits(texts)
    found = metadata()
    brings = used(found)
    rows = []
    for package in sorted(found["packages"], key=lambda package: (package["name"], package["version"])):
        if package["id"] not in brings:
            continue
        kinds = {kind for target in package["targets"] for kind in target["kind"]}
        builds = "script" if "custom-build" in kinds else "macro" if "proc-macro" in kinds else ""
        unsafe = unsafe_count(package)
        if not builds and not unsafe:
            continue
        name = package["name"]
        by = sorted(brings[package["id"]])
        does = DOES[name] if name in by else "for " + ", ".join(by[:3]) + (", …" if len(by) > 3 else "")
        who = audited(known.get(name, []), package["version"])
        rows.append(f"| {name} {package['version']} | {builds} | {unsafe or ''} | {does} | {who} |")
    wholly = sum(not row.endswith("|  |") and "| only " not in row for row in rows)
    print(DIRECT + "\n".join(direct()) + "\n")
    print(HEAD.format(rows=len(rows), all=len(brings), audited=wholly, sources=", ".join(sorted(texts))))
    print("\n".join(rows))
    print(MCAP, end="")


DIRECT = """# Dependencies

`cargo deny check` tests licenses, sources and advisories of all packages ([deny.toml](../deny.toml)).

## Packages that the crates name

The crates with a package in their tests alone are in brackets.

| package | use | crates |
|---|---|---|
"""

HEAD = """## Dependencies that are trusted

Of the {all} packages that the program contains, these {rows} run code while they are built (a build script, a procedural macro) or contain `unsafe`. The table lists
what each is used for. It is made by `python3 tools/list_trusted_code.py > docs/measurements/dependencies.md`. The count is that of the word in the sources of a package: parts
that are compiled on other systems or with other features are included. teachtree forbids `unsafe` in its own code.

*Audited by* names those whose published audits ({sources}, for `cargo vet`) lead to this version, each difference included; these
are {audited} packages. `only 1.2.3` is the last version to which audits lead. Audits by publisher (`wildcard-audits`) are not counted, and the authors of teachtree
audited no package.

Features that are not on by default are left out: `zenoh`, and `tls`, whose rustls encrypts by ring, which contains C and assembly.

| package | runs while built | `unsafe` | use | audited by |
|---|---|---|---|---|"""

MCAP = """
## The crate mcap

Tests and benches write bags with mcap 0.26; the program reads and writes MCAP by its own code. Both were tried on the bag of ROS 2 in `tests/fixtures` and on
bags of 3 to 195 MB that mcap wrote (four topics, one of them images, 60 s), whole, cut and damaged. Times are CPU seconds, medians of nine alternating runs on
one core.

| requirement | own code | mcap 0.26 |
|---|---|---|
| the file ends within a chunk | messages of whole chunks, an issue | the same messages (35 671 instead of 30 577 if check sums are tested last), an error |
| no summary | read | read in order; its reader of indexes finds none |
| a damaged chunk | the file is refused, with the reason | refused; with `emit_chunks` a loop of the caller reads the other chunks |
| a wrong check sum of a chunk | refused | refused; its reader of indexes does not test check sums |
| a chunk that claims 10 GB | read, 7 MB of memory: the claim is not used | refused with `record_length_limit`; without it 10 GB are allocated |
| a record that claims 1 TB | refused | refused with `record_length_limit`; without it the program aborts |
| 135 kB of zstd that are 4 GB | refused at 256 MB: 0.2 s, 270 MB of memory | refused after 4 GB: 17 s, 7 MB of memory |
| zstd and lz4 | both, lz4 in Rust | both, lz4 in C |
| a file, or each message, compressed by zstd | read | by the caller |
| the chunks of an original are copied unchanged | 171 of 171 | its writer takes messages only; chunks of lz4 become chunks of zstd |
| time to copy 163 MB of zstd, 193 MB of lz4 | 0.97 s, 0.43 s | 1.46 s, 1.29 s |
| time to read 163 MB of zstd, 193 MB of lz4, 195 MB without compression | 0.44 s, 0.24 s, 0.06 s | 0.25 s, 0.11 s, 0.03 s |
| six messages of one topic of 163 MB | all is read: 163 MB, 0.44 s | by the index: 5.7 MB, 0.01 s |
| further packages in the program | none | 10, among them C code (lz4-sys) and two procedural macros |

The own code stays. The writer must copy chunks unchanged, and a second writer for new files would be further code. In the reader, mcap would replace the 110
lines that split records and unpack chunks; the rules for cut and compressed files would remain. mcap can read one topic by the index; the program cannot, since
it reads a bag before the binding selects topics.
"""

if __name__ == "__main__":
    main(sys.argv[1:])
