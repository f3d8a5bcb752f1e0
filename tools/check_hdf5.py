#!/usr/bin/env python3
"""Checks a copy that `teachtree annotate FILE.hdf5 -o COPY --signal …` wrote, with h5py.

    python3 -m venv venv && venv/bin/pip install h5py
    venv/bin/python tools/check_hdf5.py FILE COPY

- Every data set and attribute of the file is in the copy with the same type, shape and values, and nothing else is but signals and mask.
- Fields of success agree: the attribute `success`, the lists `mask/teachtree_success` and `…_failure`, and `rewards` and `dones` where they are new.
- Signals are flat int64 of 0 and then 1, as long as the recording; `mask/teachtree_ok` has those recordings whose signals all rise.
- The ends of subtasks by MimicGen's documented rule are printed: the row after the one at which the signal rises, as in `actions[start:end]`.
"""

import sys

import h5py
import numpy as np

GROUPS = ("subtask_term_signals", "subtask_start_signals")
MASK = "mask/teachtree_"
LISTS = {f"{MASK}{name}": name for name in ("ok", "success", "failure")}


def objects(file):
    found = {"/": file}
    file.visititems(lambda name, item: found.setdefault(name, item) and None)
    return found


def same_attributes(one, other, name):
    ours, theirs = dict(one.attrs), dict(other.attrs)
    if name == "/":
        ours.pop("teachtree", None)
        theirs.pop("teachtree", None)
    if is_recording(name) and "success" in theirs:
        ours.pop("success", None)
        theirs.pop("success")
    assert sorted(ours) == sorted(theirs), f"{name}: attributes differ"
    for key, value in ours.items():
        assert np.array_equal(np.asarray(value), np.asarray(theirs[key])), f"{name}: attribute {key} differs"


def is_recording(name):
    return name.startswith("data/") and name.count("/") == 1


def is_new(name):
    is_reward = name.count("/") == 2 and name.startswith("data/") and name.endswith(("/rewards", "/dones"))
    return name == "mask" or name in LISTS or is_reward or any(part in GROUPS for part in name.split("/"))


def check_success(ours, other, lists):
    """Compares the fields of success of each recording; which recordings are successes."""
    outcomes = {name: name in lists["success"] for name in lists["success"] + lists["failure"]}
    for name, is_success in outcomes.items():
        group = other["data"][name]
        if "success" not in ours.get(f"data/{name}").attrs:
            assert group.attrs["success"] == is_success, f"{name}: success"
        if f"data/{name}/rewards" in ours or f"data/{name}/dones" in ours:
            continue
        rewards, dones = group["rewards"][()], group["dones"][()]
        assert rewards.dtype == np.float64 and dones.dtype == np.int64 and rewards.shape == group["actions"].shape[:1]
        assert np.array_equal(rewards, dones) and np.array_equal(rewards, np.sort(rewards)), f"{name}: rewards"
        assert set(np.unique(rewards)) <= {0, 1} and rewards[-1] == is_success, f"{name}: rewards"
    return [name for name, is_success in outcomes.items() if is_success]


def main(path, copy):
    with h5py.File(path) as one, h5py.File(copy) as other:
        ours, theirs = objects(one), objects(other)
        compared = 0
        for name, item in ours.items():
            if is_new(name) and name != "mask" and not name.endswith(("/rewards", "/dones")):
                continue
            assert name in theirs, f"{name} is not in the copy"
            same_attributes(item, theirs[name], name)
            if isinstance(item, h5py.Dataset):
                assert item.dtype == theirs[name].dtype and item.shape == theirs[name].shape, name
                equal = np.array_equal(item[()], theirs[name][()], equal_nan=item.dtype.kind in "fc")
                assert equal, f"{name} differs"
            compared += 1
        data_sets = [name for name, item in theirs.items() if isinstance(item, h5py.Dataset)]
        for name in theirs.keys() - ours.keys():
            # Groups that were made for signals, such as `obs` in the layout of Isaac Lab.
            below = [inner for inner in data_sets if inner.startswith(f"{name}/")]
            assert is_new(name) or below and all(map(is_new, below)), f"{name} is new"
        lists = {kind: [name.decode() for name in other[path][()]] for path, kind in LISTS.items() if path in other}
        complete = lists.get("ok", [])
        if "success" in lists:
            print("successes", check_success(ours, other, lists), "failures", lists["failure"])
        data = other["data"] if "data" in other else other
        for recording in data:
            group = data[recording]
            info = next((group[path] for path in ("datagen_info", "obs/datagen_info") if f"{path}/{GROUPS[0]}" in group), None)
            if info is None:
                continue
            rows, ends, rises = len(group["actions"]), {}, []
            for kind in GROUPS:
                for name, signal in info[kind].items() if kind in info else ():
                    values = signal[()]
                    assert values.dtype == np.int64 and values.shape == (rows,), f"{recording}/{name}: {values.dtype} {values.shape}"
                    steps = np.diff(values)
                    assert set(np.unique(values)) <= {0, 1} and steps.min(initial=0) >= 0, f"{recording}/{name} falls"
                    rises.append(bool(values.any()))
                    if kind == GROUPS[0] and steps.any():
                        ends[name] = int(np.flatnonzero(steps)[0]) + 1 + 1
            assert all(rises) == (recording in complete), f"{recording}: mask"
            print(recording, f"{rows} rows", dict(sorted(ends.items(), key=lambda end: end[1])))
        print(f"{copy}: {compared} objects equal, {len(complete)} complete")


if __name__ == "__main__":
    main(*sys.argv[1:])
