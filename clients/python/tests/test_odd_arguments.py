"""Every argument of every operation, given what does not belong there: an error of this package that names the argument."""

import inspect
import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrol

from .support.odd import ODD, error_of, must_be_named

EYE = np.eye(4)
POINT = [[0.0, 0.0, 0.0]]
BALL = [[0.0, 0.0, 0.0, 0.2]]
EDGE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
BOX = [[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]]

OPERATIONS: dict[str, dict[str, Any]] = {
    "query": {"points": POINT},
    "classify": {"points": POINT},
    "insert": {"points": POINT, "align": False, "guess": EYE, "force": True},
    "align": {"points": POINT, "guess": EYE},
    "localize": {"points": POINT, "time_limit_s": 0.01},
    "check_poses": {"body": BALL, "configurations": EDGE},
    "check_spheres": {"spheres": BALL},
    "check_motions": {"body": BALL, "configurations": EDGE},
    "cast_rays": {"origins": POINT, "directions": [[1.0, 0.0, 0.0]]},
    "nearest": {"points": POINT, "radius_m": 0.5},
    "frontiers": {"box": BOX},
    "grid": {"area": [[0, 0], [1, 1]]},
    "whole_grid": {"area": [[0, 0], [1, 1]]},
    "voxels": {"box": BOX},
    "count_voxels": {},
    "block": {"box": BOX},
    "distances": {"box": BOX},
    "observers": {"point": POINT[0]},
    "trajectory": {},
    "events": {},
    "delete": {"box": BOX},
    "undo": {"robot": "r", "since_revision": 1 << 40},
    "keep_out": {"name": "k", "box": BOX},
    "remove_keep_out": {"name": "none"},
    "with_timeout": {"timeout_s": 5.0},
    "with_robot": {"robot": "r"},
}
"""A call of each operation that can be sent."""

TOGETHER = {
    ("cast_rays", "ends"): ["directions"],
    ("observers", "voxel"): ["point"],
    ("delete", "points"): ["box"],
    ("delete", "voxels"): ["box"],
    ("delete", "sphere"): ["box"],
    ("delete", "oriented_box"): ["box"],
    ("keep_out", "sphere"): ["box"],
    ("keep_out", "oriented_box"): ["box"],
    ("keep_out", "prism"): ["box"],
    ("insert", "motion"): ["guess"],
    ("insert", "constant_velocity"): ["guess"],
    ("align", "motion"): ["guess"],
    ("align", "constant_velocity"): ["guess"],
    ("undo", "change"): ["robot", "since_revision"],
    ("undo", "revision"): ["robot", "since_revision"],
}
"""What is left out where another argument is given."""

WITH: dict[tuple[str, str], dict[str, Any]] = {
    ("insert", "session"): {"scan_id": 1},
    ("localize", "gravity_in_map"): {"gravity_in_sensor": [0, 0, -1]},
    ("undo", "session"): {"scan_id": 1},
}
"""What is given together with another argument."""

NAMED_OTHERWISE = {
    ("check_poses", "body"): "body|configurations",
    ("check_motions", "body"): "body|configurations",
    ("check_motions", "lengths"): "lengths|configurations",
    ("cast_rays", "directions"): "directions|origins",
    ("cast_rays", "ends"): "ends|origins",
    ("delete", "box"): "box|the target",
    ("keep_out", "box"): "box|the shape",
    ("insert", "session"): "session|scan_id",
}
"""Where what is wrong may be seen in another argument, since the two have to fit, or one has to be there."""


CASES = [
    (operation, argument)
    for operation in OPERATIONS
    for argument in list(inspect.signature(getattr(mrol.Map, operation)).parameters)[1:]
]
"""Every argument of every operation."""


@pytest.mark.parametrize(("operation", "argument"), CASES, ids=[f"{operation}-{argument}" for operation, argument in CASES])
@pytest.mark.filterwarnings("ignore:.*converting a masked element to nan:UserWarning")
def test_what_does_not_belong_there_is_refused(hall: mrol.Map, operation: str, argument: str) -> None:
    names = NAMED_OTHERWISE.get((operation, argument), argument)
    for odd, value in ODD.items():
        if (argument == "min_revision" and odd == "five") or (odd == "None" and (operation, argument) in TOGETHER):
            # The server would wait for that revision; and None is to give nothing.
            continue
        if argument == "progress" and callable(value):
            # It is called, and what it raises ends the call as it is.
            continue
        given = {**OPERATIONS[operation], **WITH.get((operation, argument), {}), argument: value}
        for left_out in TOGETHER.get((operation, argument), []):
            given.pop(left_out)
        must_be_named(lambda given=given: getattr(hall, operation)(**given), names, odd)  # type: ignore[misc]


def test_every_operation_is_asked() -> None:
    apart = {"describe", "keep_outs", "restore", "snapshot", "watch", "watch_events"}
    operations = {name for name, _ in inspect.getmembers(mrol.Map, inspect.isfunction) if not name.startswith("_")}
    assert operations == set(OPERATIONS) | apart


def no_file(odd: str) -> bool:
    """Whether a value is no path: text is one."""
    return odd not in ("text", "None")


@pytest.mark.parametrize("odd", ODD)
def test_what_is_no_path_and_no_time_is_refused(
    client: mrol.Client, hall: mrol.Map, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, odd: str
) -> None:
    monkeypatch.chdir(tmp_path)
    value = ODD[odd]
    with pytest.raises((mrol.ArgumentError, mrol.InvalidArgument)) as refused:
        hall.restore(value)
    assert isinstance(refused.value, mrol.InvalidArgument) == (odd == "bytes")
    if no_file(odd):
        with pytest.raises(mrol.ArgumentError, match="^file must be a path"):
            hall.snapshot(value)
        address = "https://localhost:1"
        for name in ("key_file", "ca", "client_cert"):
            with pytest.raises(mrol.ArgumentError, match=f"^{name} must be "):
                mrol.connect(address, **{name: value})
        with pytest.raises(mrol.ArgumentError, match="^client_"):
            mrol.connect(address, client_cert=tmp_path, client_key=value)
    calls: dict[str, Callable[[], object]] = {
        "progress": lambda: hall.snapshot("a.mrol", progress=value),
        "progress ": lambda: hall.restore(b"", progress=value),
        "progress  ": lambda: hall.watch(progress=value),
        "timeout_s": lambda: hall.snapshot("a.mrol", timeout_s=value),
        "timeout_s ": lambda: hall.restore(b"", timeout_s=value),
        "replace": lambda: hall.restore(b"", replace=value),
        "name": lambda: client.restore(value, b""),
        "since": lambda: hall.watch(value),
        "silence_max_s": lambda: hall.watch(silence_max_s=value),
        "silence_max_s ": lambda: hall.watch_events(silence_max_s=value),
        "viewpoints": lambda: hall.watch(viewpoints=value),
        "heartbeats": lambda: hall.watch(heartbeats=value),
        "delta_level": lambda: hall.watch(delta_level=value),
        "box": lambda: hall.watch(box=value),
        "since_number": lambda: hall.watch_events(since_number=value),
        "robot": lambda: hall.watch_events(robot=value),
    }
    for name, call in calls.items():
        # What can be called is a progress.
        if not (name.strip() == "progress" and callable(value)):
            must_be_named(call, name.strip(), odd)
    assert os_names(tmp_path) <= {"a.mrol"}


def os_names(folder: Path) -> set[str]:
    """What is in a folder."""
    return {entry.name for entry in folder.iterdir()}


@pytest.mark.parametrize("odd", ODD)
def test_what_makes_no_client_and_no_map_is_refused(client: mrol.Client, odd: str) -> None:
    value = ODD[odd]
    # Nothing listens there: what can be sent ends by that.
    nowhere = "127.0.0.1:1"
    quick = {"timeout_s": 0.01, "patience_s": 0.01}
    for name in ("timeout_s", "patience_s", "request_bytes_max", "answer_bytes_max", "key"):
        error = error_of(lambda name=name: mrol.connect(nowhere, **{**quick, name: value}))  # type: ignore[misc]
        assert isinstance(error, mrol.ConnectFailed) or (isinstance(error, mrol.ArgumentError) and error.argument == name)
    if odd not in ("five", "more than 64 bits"):
        error = error_of(lambda: mrol.connect(nowhere, **quick, wait_s=value))
        assert isinstance(error, mrol.ConnectFailed) == (odd in ("a half", "a number of numpy"))
    if odd != "text":
        # That one may be the name of a host.
        with pytest.raises(mrol.ArgumentError, match="^address must be "):
            mrol.connect(value)
    settings = {"levels": 2, "filter": "none", "moments": False}
    numbers = itertools.count()
    for name in ("name", "resolution", "robot", *settings):
        given = {"name": f"odd-{next(numbers)}", "resolution": 0.1, **settings, name: value}
        must_be_named(lambda given=given: client.map(**given), f"{name}|resolution", odd)  # type: ignore[misc]
    for fields in ({"hashes": value, "bits_per_key": 10.0}, {"hashes": 3, "bits_per_key": value}):
        must_be_named(lambda fields=fields: client.map("odd", 0.1, filter=mrol.FilterSettings(**fields)), "filter", odd)  # type: ignore[misc]
    must_be_named(lambda: client.delete_map(value), "name", odd)
    must_be_named(lambda: client.rename_map(value, "odd"), "name", odd)
    must_be_named(lambda: client.rename_map("odd", value), "to", odd)
    must_be_named(lambda: client.with_timeout(value), "timeout_s", odd)
    for of in client.maps().maps:
        if of.name.startswith("odd"):
            client.delete_map(of.name)


PARTS: dict[str, tuple[str, Callable[[mrol.Map, Any], object]]] = {
    "a sphere's center": ("sphere", lambda m, odd: m.delete(sphere=mrol.Sphere(odd, 0.1))),
    "a sphere's radius": ("sphere", lambda m, odd: m.delete(sphere=([0, 0, 0], odd))),
    "a box's corner": ("box", lambda m, odd: m.delete(box=mrol.Box(odd, [9, 9, 9]))),
    "an oriented box's pose": ("oriented_box", lambda m, odd: m.delete(oriented_box=mrol.OrientedBox(odd, [1, 1, 1]))),
    "an oriented box's size": ("oriented_box", lambda m, odd: m.delete(oriented_box=mrol.OrientedBox(EYE, odd))),
    "a listed box's size": ("box", lambda m, odd: m.voxels(box=mrol.OrientedBox(EYE, odd))),
    "a prism's corners": ("prism", lambda m, odd: m.keep_out("k", prism=mrol.Prism(odd, 0, 1))),
    "a prism's height": ("prism", lambda m, odd: m.keep_out("k", prism=mrol.Prism([[0, 0], [1, 0], [0, 1]], 0, odd))),
    "an ignored shape": ("ignored", lambda m, odd: m.check_poses(BALL, EDGE, ignored=[odd])),
    "an ignored sphere": ("ignored", lambda m, odd: m.check_poses(BALL, EDGE, ignored=[mrol.Sphere(odd, 1)])),
    "links": ("body", lambda m, odd: m.check_poses(mrol.Body(odd), EDGE)),
    "a link": ("body", lambda m, odd: m.check_poses(mrol.Body([odd]), EDGE)),
    "spheres of a link": ("body", lambda m, odd: m.check_poses(mrol.Link(spheres=odd), EDGE)),
    "points of a link": ("body", lambda m, odd: m.check_poses(mrol.Link(points=odd), EDGE)),
    "padding of a link": ("body", lambda m, odd: m.check_poses(mrol.Link(BALL, padding_m=odd), EDGE)),
    "a configuration": ("configurations", lambda m, odd: m.check_poses(BALL, [mrol.Pose.identity(), odd])),
    "a camera's pose": ("view", lambda m, odd: m.voxels(view=mrol.View(odd, [1, 1], [0.1, 5]))),
    "a camera's angles": ("view", lambda m, odd: m.voxels(view=mrol.View(EYE, odd, [0.1, 5]))),
    "a camera's range": ("view", lambda m, odd: m.voxels(view=mrol.View(EYE, [1, 1], odd))),
    "a version": ("since", lambda m, odd: m.watch(mrol.Version(odd, "u"))),
    "a version's map": ("since", lambda m, odd: m.watch(mrol.Version(1, odd))),
    "a pose's translation": ("translation_m", lambda _, odd: mrol.Pose(odd, [0, 0, 0, 1])),
    "a pose's rotation": ("rotation_xyzw", lambda _, odd: mrol.Pose([0, 0, 0], odd)),
    "a part of a pose": ("pose", lambda _, odd: mrol.Pose.of((odd, [0, 0, 0, 1]))),
    "points of a pose": ("points", lambda _, odd: mrol.Pose.identity().apply(odd)),
    "another pose": ("the pose on the right", lambda _, odd: mrol.Pose.identity() @ odd),
}


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.filterwarnings("ignore:.*converting a masked element to nan:UserWarning")
def test_what_does_not_belong_into_a_part_of_an_argument_is_named(hall: mrol.Map, part: str) -> None:
    name, call = PARTS[part]
    for odd, value in ODD.items():
        must_be_named(lambda value=value: call(hall, value), name, odd)  # type: ignore[misc]
