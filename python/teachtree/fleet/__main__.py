"""``python -m teachtree.fleet``: a fleet from the command line, for one machine, for arrays of jobs, for Dask and Ray."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from .. import Error
from . import Job, Ran, diff, jobs, page, run


def part(text: str) -> tuple[int, int]:
    """Reads ``I/N``."""
    at, slash, of = text.partition("/")
    if not (slash and at.isdigit() and of.isdigit() and 1 <= int(at) <= int(of)):
        raise argparse.ArgumentTypeError(f"expected I/N with I from 1 to N, found `{text}`")
    return int(at), int(of)


def pair(text: str) -> tuple[str, str]:
    """Reads ``NAME=VALUE``."""
    name, sign, value = text.partition("=")
    if not (name and sign):
        raise argparse.ArgumentTypeError(f"expected NAME=VALUE, found `{text}`")
    return name, value


def storage(text: str) -> dict[str, Any]:
    """Reads storage options."""
    try:
        found = json.loads(text)
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise argparse.ArgumentTypeError(f'expected a JSON object such as {{"anon": true}}, found `{text}`')
    return found


def _job(args: argparse.Namespace) -> Job:
    given = {"hand": args.hand, "binding": args.binding, "scene": args.scene, "expect": args.expect, "project": args.project}
    return Job(rules=args.rules, params=dict(args.set), **given)


def _run(args: argparse.Namespace) -> Ran:
    given: dict[str, Any] = {"shard_size": args.shard_size, "shard": args.shard, "options": args.options}
    if args.dask is not None:
        from distributed import Client

        from .. import dask

        with Client(args.dask) if args.dask else Client() as client:
            return dask.run(args.sources, _job(args), args.out, client=client, **given)
    if args.ray:
        from .. import ray

        return ray.run(args.sources, _job(args), args.out, **given)

    def progress(done: int, of: int) -> None:
        print(f"\r{done} of {of}", end="", file=sys.stderr)

    ran = run(args.sources, _job(args), args.out, jobs=args.jobs, progress=progress if sys.stderr.isatty() else None, **given)
    return ran


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m teachtree.fleet", description="Analyzes very many recordings; results are Parquet.")
    commands = parser.add_subparsers(dest="command", required=True)
    what = argparse.ArgumentParser(add_help=False)
    what.add_argument("--out", required=True, metavar="URL", help="the folder of results, on a disk or in an object store")
    what.add_argument("--rules", action="append", default=[], metavar="FILE", help="rule files; by default the shipped ones")
    what.add_argument("--set", action="append", type=pair, default=[], metavar="NAME=VALUE", help="a param, such as touch_on=0.1N")
    what.add_argument("--hand", metavar="FILE", help="the hand model")
    what.add_argument("--binding", metavar="FILE", help="how the columns of foreign logs become channels")
    what.add_argument("--scene", metavar="FILE", help="a scene instead of the one that each log carries")
    what.add_argument("--expect", metavar="TASKS", help="the tasks that each recording should contain: `peg_in_hole x 2, turn_screw`")
    what.add_argument("--project", metavar="LOG", help="take what is not named here from the teachtree.yaml of this recording")
    what.add_argument("--options", type=storage, default={}, metavar="JSON", help="storage options of fsspec")
    runs = commands.add_parser("run", parents=[what], help="analyze what is not done yet")
    runs.add_argument("sources", nargs="+", metavar="SOURCE", help="folders, files, data sets, URLs")
    runs.add_argument("--shard", type=part, metavar="I/N", help="only the I-th of N parts, from 1: for arrays of jobs")
    runs.add_argument("--shard-size", type=int, default=64, metavar="N", help="recordings that are committed together")
    runs.add_argument("--jobs", type=int, default=1, metavar="N", help="threads, without an engine")
    runs.add_argument("--dask", nargs="?", const="", metavar="ADDRESS", help="run by Dask: a scheduler, or workers on this machine")
    runs.add_argument("--ray", action="store_true", help="run by Ray")
    pages = commands.add_parser("page", parents=[what], help="write a page of the results")
    pages.add_argument("--to", required=True, metavar="FOLDER", help="the folder of the page")
    compares = commands.add_parser("diff", help="compare two jobs of one folder")
    compares.add_argument("a", help="the digest of a job, as `jobs` lists it")
    compares.add_argument("b", help="the digest of another one")
    lists = commands.add_parser("jobs", help="list the jobs of a folder")
    for command in (compares, lists):
        command.add_argument("--out", required=True, metavar="URL", help="the folder of results")
        command.add_argument("--options", type=storage, default={}, metavar="JSON", help="storage options of fsspec")
    return parser


def main() -> int:
    """Runs the command line; the exit status: 0 fine, 2 bad usage or input, 3 some recordings cannot be used."""
    args = _parser().parse_args()
    try:
        if args.command == "run":
            ran = _run(args)
            print(f"{ran.done} done, {ran.failed} of them cannot be used, {ran.skipped} were done before")
            return 3 if ran.failed else 0
        if args.command == "page":
            found = page(args.out, _job(args), args.to, options=args.options)
            print(f"{args.to}/index.html names {len(found)} recordings to look at")
        elif args.command == "diff":
            print(diff(args.out, args.a, args.b, options=args.options))
        else:
            for known in jobs(args.out, args.options):
                print(known["digest"], ", ".join(known["rules"]) or "the shipped rules", known["params"] or "")
    except (Error, OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
