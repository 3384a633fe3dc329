"""Every argument of every question and every change, given what does not belong there."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrol
import mrol.replica

from ..support.odd import ODD, error_of, must_be_named

EYE = np.eye(4)
POINT = [[0.0, 0.0, 0.0]]
BALL = [[0.0, 0.0, 0.0, 0.2]]
EDGE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
WAY = np.array([[0, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0, 1]], np.float32)
BOX = [[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]]
EMPTY_BODY = mrol.replica.PreparedBody(BALL)

QUESTIONS: dict[str, dict[str, Any]] = {
    "query": {"points": POINT},
    "classify": {"points": POINT},
    "check_poses": {"body": BALL, "configurations": EDGE},
    "check_spheres": {"spheres": BALL},
    "check_motions": {"body": BALL, "configurations": EDGE},
    "motion_is_free": {"body": EMPTY_BODY, "configurations": WAY},
    "cast_rays": {"origins": POINT, "directions": [[1.0, 0.0, 0.0]]},
    "nearest": {"points": POINT, "radius_m": 0.5},
    "frontiers": {"box": BOX},
    "grid": {"area": [[0, 0], [1, 1]]},
}
"""A question of each kind that has an answer."""

OF_LOCAL_MAPS: dict[str, dict[str, Any]] = {
    "insert": {"points": POINT, "align": False, "guess": EYE, "force": True},
    "align": {"points": POINT, "guess": EYE},
    "localize": {"points": POINT, "time_limit_s": 0.01},
    "voxels": {},
    "delete": {"shape": mrol.Box([8, 8, 8], [9, 9, 9])},
}

TOGETHER = {
    ("cast_rays", "ends"): ["directions"],
    ("insert", "motion"): ["guess"],
    ("insert", "constant_velocity"): ["guess"],
    ("align", "motion"): ["guess"],
    ("align", "constant_velocity"): ["guess"],
}
"""What is left out where another argument is given."""

NAMED_OTHERWISE = {
    ("check_poses", "body"): "body|configurations",
    ("check_motions", "body"): "body|configurations",
    ("check_motions", "lengths"): "lengths|configurations",
    ("cast_rays", "directions"): "directions|origins",
    ("cast_rays", "ends"): "ends|origins",
}


@pytest.fixture(scope="session")
def local() -> mrol.replica.LocalMap:
    """A map without a server."""
    made = mrol.replica.LocalMap(0.1, levels=2)
    made.insert([[0.01, 0.0, 0.0]], align=False)
    return made


def cases(operations: dict[str, Any]) -> list[tuple[str, str]]:
    """All arguments of operations."""
    of_map = {name: list(inspect.signature(getattr(mrol.replica.LocalMap, name)).parameters)[1:] for name in operations}
    return [(operation, argument) for operation, arguments in of_map.items() for argument in arguments]


def ask_all(asked: Any, operation: str, argument: str, call: dict[str, Any]) -> None:
    """Asks with each odd value in the place of an argument."""
    names = NAMED_OTHERWISE.get((operation, argument), argument)
    for odd, value in ODD.items():
        if (argument == "min_revision" and odd == "five") or (odd == "None" and (operation, argument) in TOGETHER):
            # The copy has no such revision, and a map without a server would wait for it; and None is to give nothing.
            continue
        if (operation, argument, odd) == ("motion_is_free", "scope", "a dict"):
            # What is no option is a TypeError, as a keyword that is none.
            continue
        given = {**call, argument: value}
        if (operation, argument) == ("localize", "gravity_in_map"):
            given["gravity_in_sensor"] = [0, 0, -1]
        for left_out in TOGETHER.get((operation, argument), []):
            given.pop(left_out)
        must_be_named(lambda given=given: getattr(asked, operation)(**given), names, odd)  # type: ignore[misc]


@pytest.mark.parametrize(("operation", "argument"), cases(QUESTIONS))
@pytest.mark.filterwarnings("ignore:.*converting a masked element to nan:UserWarning")
def test_what_does_not_belong_into_a_question_is_refused(
    replica: mrol.replica.Replica, local: mrol.replica.LocalMap, operation: str, argument: str
) -> None:
    for asked in (replica, local):
        ask_all(asked, operation, argument, QUESTIONS[operation])


@pytest.mark.parametrize(("operation", "argument"), cases(OF_LOCAL_MAPS))
@pytest.mark.filterwarnings("ignore:.*converting a masked element to nan:UserWarning")
def test_what_does_not_belong_into_a_change_is_refused(local: mrol.replica.LocalMap, operation: str, argument: str) -> None:
    ask_all(local, operation, argument, OF_LOCAL_MAPS[operation])


def test_every_operation_is_asked() -> None:
    apart = {"close", "load", "save", "status", "revision", "wait_for_revision", "check_age"}
    for kind, operations in ((mrol.replica.Replica, QUESTIONS), (mrol.replica.LocalMap, QUESTIONS | OF_LOCAL_MAPS)):
        public = {name for name, _ in inspect.getmembers(kind) if not name.startswith("_")}
        assert public == (set(operations) | apart) & (public | set(operations))


@pytest.mark.parametrize("odd", ODD)
def test_what_makes_no_map_and_no_replica_is_refused(
    local: mrol.replica.LocalMap, replica: mrol.replica.Replica, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, odd: str
) -> None:
    monkeypatch.chdir(tmp_path)
    value = ODD[odd]
    for name in ("resolution", "levels", "bloom", "moments"):
        must_be_named(lambda name=name: mrol.replica.LocalMap(**{"resolution": 0.1, "levels": 2, name: value}), name, odd)  # type: ignore[misc]
    if odd != "text":
        for call in (lambda: local.save(value), lambda: mrol.replica.LocalMap.load(value)):
            error = error_of(call)
            assert isinstance(error, mrol.ArgumentError)
            assert error.argument == "file"
    if odd != "None":
        must_be_named(lambda: mrol.replica.PreparedBody(value), "body", odd)
    for name in ("revision", "timeout_s"):
        if (name, odd) not in (("timeout_s", "five"), ("timeout_s", "a half"), ("revision", "five")):
            given: dict[str, Any] = {"revision": 1 << 40, "timeout_s": 0.01, name: value}
            error = error_of(lambda given=given: replica.wait_for_revision(**given))  # type: ignore[misc]
            assert isinstance(error, mrol.DeadlineExceeded) or (isinstance(error, mrol.ArgumentError) and error.argument == name)
    if odd not in ("five", "a half", "a number of numpy"):
        must_be_named(lambda: replica.check_age(value), "age_max_s", odd)
    nowhere = {"address": "http://127.0.0.1:9", "map": "m"}
    of_connection = ("address", "map", "key", "ca", "certificate")
    for name in (*of_connection, "region", "silence_s", "blocks_max", "bloom", "viewpoints", "age_max_s"):
        if (name, odd) == ("address", "text"):
            continue
        options = {"private_key": "never.pem"} if name == "certificate" and odd != "None" else {}
        error = error_of(lambda name=name, options=options: mrol.replica.Replica(**{**nowhere, **options, name: value}))  # type: ignore[misc]
        assert isinstance(error, mrol.ConnectFailed | mrol.InvalidArgument | ValueError), (name, error)
        if isinstance(error, mrol.ArgumentError):
            assert error.argument.startswith(name) or options
    assert {entry.name for entry in tmp_path.iterdir()} <= {"odd"}


def test_masked_values_are_refused(replica: mrol.replica.Replica) -> None:
    hidden = np.ma.array([0.0, 0.0, 0.0], mask=[1, 0, 0])
    way = np.ma.array(WAY, mask=np.zeros_like(WAY, bool))
    assert replica.motion_is_free(EMPTY_BODY, way) == replica.motion_is_free(EMPTY_BODY, WAY)
    way[1, 0] = np.ma.masked
    calls: dict[str, Callable[[], object]] = {
        "points": lambda: replica.query([hidden]),
        "points ": lambda: replica.classify([hidden]),
        "points  ": lambda: replica.nearest([hidden, hidden], 1.0),
        "configurations": lambda: replica.motion_is_free(EMPTY_BODY, way),
        "configurations ": lambda: replica.check_motions(EMPTY_BODY, way),
        "configurations  ": lambda: replica.check_poses(EMPTY_BODY, list(way)),
        "ends": lambda: replica.cast_rays([0, 0, 0], ends=[hidden]),
        "spheres": lambda: replica.check_spheres([np.ma.array([0, 0, 0, 1.0], mask=[0, 0, 0, 1])]),
        "body.links[0].spheres": lambda: mrol.replica.PreparedBody([np.ma.array([0, 0, 0, 1.0], mask=[0, 0, 0, 1])]),
    }
    for name, call in calls.items():
        with pytest.raises(mrol.ArgumentError, match=r"\.filled\(numpy\.nan\)") as refused:
            call()
        assert refused.value.argument == name.strip()


def test_no_error_shows_a_key_or_a_password(tmp_path: Path) -> None:
    secret = "mrol_0123456789abcdefghijklmnopqrstuvwxyz"  # noqa: S105
    (tmp_path / "file").write_text(secret)
    refused: list[tuple[str, dict[str, Any]]] = [
        (f"http://user:{secret}@host", {}),
        (f"user:{secret}@host:1", {}),
        (f"https://:{secret}@host", {}),
        *[(f"http://127.0.0.1:9{of}", {}) for of in (f"/{secret}", f"?k={secret}", f"/?k={secret}", f"#{secret}", f":{secret}")],
        *[(of, {}) for of in (f"host:{secret}", f"u:{secret}%40h", f"host/{secret}", f"{secret}://host", f"http://h h{secret}")],
        *[("127.0.0.1:9", {"key": of}) for of in (f"{secret}\n{secret}", [secret], secret.encode(), f"{secret}\u00fc")],
        *[("127.0.0.1:9", {"ca": of}) for of in (secret, secret.encode(), tmp_path / "file")],
        *[("127.0.0.1:9", {"certificate": of, "private_key": of}) for of in (secret, tmp_path / "file")],
        ("127.0.0.1:9", {"certificate": tmp_path / "file", "private_key": secret}),
        ("127.0.0.1:9", {"private_key": secret}),
    ]
    for address, options in refused:
        with pytest.raises(ValueError, match="must be|be PEM|no certificate") as error:
            mrol.replica.Replica(address, "m", **options)
        assert isinstance(error.value, mrol.MrolError)
        assert secret not in repr(error.value) + str(error.value) + repr(vars(error.value))
        assert error.value.__context__ is None or secret not in repr(error.value.__context__)
