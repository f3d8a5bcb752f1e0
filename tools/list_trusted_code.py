"""Lists the dependencies that run code while building (build scripts, procedural macros) or contain `unsafe`: docs/dependencies.md.

    python3 tools/list_trusted_code.py > docs/dependencies.md

Dependencies of the program with its default features on Linux, without those of tests. `unsafe` is counted in sources, comments left out.
"""

import json
import pathlib
import re
import subprocess

# What each direct dependency does here; others are named by the one that brings them.
DOES = {
    "annotate-snippets": "draws compiler messages",
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
    "hdf5-pure": "HDF5 files",
    "httparse": "requests to local pages",
    "indexmap": "tables in the order of their files",
    "indicatif": "progress bars",
    "lsp-server": "the language server",
    "gen-lsp-types": "the language server",
    "lz4_flex": "lz4 in MCAP, bags and Zarr",
    "memchr": "ends of lines in text logs",
    "nalgebra": "vectors and rotations",
    "npyz": "NumPy files",
    "parquet": "Parquet files",
    "parry3d-f64": "distances of shapes",
    "pest": "the grammar of rules",
    "pest_derive": "the grammar of rules",
    "pulp": "loops of the engine by processor",
    "rand": "simulated operators",
    "rand_chacha": "simulated operators",
    "rand_distr": "simulated operators",
    "rapier3d-f64": "the simulated environment",
    "rayon": "several recordings at once",
    "roxmltree": "URDF and other XML",
    "serde": "types of YAML and JSON",
    "serde_json": "JSON",
    "serde_yaml": "YAML",
    "similar": "patches",
    "tempfile": "temporary files beside outputs",
    "terminal_size": "width of the terminal",
    "tungstenite": "WebSockets",
    "zip": "NPZ and zipped Zarr",
    "zstd": "zstd in MCAP and Zarr",
}


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
    for direct in below(root):
        if direct == root or names[direct] not in DOES:
            continue
        open_ids = [direct]
        while open_ids:
            id = open_ids.pop()
            if names[direct] not in brings.setdefault(id, set()):
                brings[id].add(names[direct])
                open_ids.extend(below(id))
    return brings


def unsafe_count(package):
    folder = pathlib.Path(package["manifest_path"]).parent
    count = 0
    for file in (folder / "src").rglob("*.rs"):
        text = re.sub(r"//[^\n]*|/\*.*?\*/", "", file.read_text(errors="replace"), flags=re.S)
        count += len(re.findall(r"\bunsafe\b(?!_)", text))
    return count


def main():
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
        by = sorted(brings[package["id"]] - {name})
        does = DOES.get(name) or "for " + ", ".join(by[:3]) + (", …" if len(by) > 3 else "")
        rows.append(f"| {name} {package['version']} | {builds} | {unsafe or ''} | {does} |")
    print(HEAD.format(rows=len(rows), all=len(brings)))
    print("\n".join(rows))


HEAD = """# Dependencies that are trusted

Of the {all} packages that the program contains, these {rows} run code while they are built (a build script, a procedural macro) or contain `unsafe`. The table lists
what each is used for. It is made by `python3 tools/list_trusted_code.py > docs/dependencies.md`. The count is that of the word in the sources of a package: parts
that are compiled on other systems or with other features are included. teachtree forbids `unsafe` in its own code.

`cargo deny check` tests licenses, sources and advisories of all packages ([deny.toml](../deny.toml)).

| package | runs while built | `unsafe` | use |
|---|---|---|---|"""

if __name__ == "__main__":
    main()
