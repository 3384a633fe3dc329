"""Poses, addresses, keys of voxels and messages: what is computed here, against plain ways to compute it."""

import pickle
import struct

import numpy as np
import pytest

import mrol
from mrol._bits import BLOCK, indices_of, voxels_of
from mrol._protobuf import Message
from mrol._transport.address import Address
from mrol.pose import sevens_of


def rotations(count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Rotations of all kinds, those by half a turn among them."""
    rng = np.random.default_rng(3)
    q, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    q[np.linalg.det(q) < 0] *= -1
    halves = [np.diag(signs) for signs in ((1, -1, -1), (-1, 1, -1), (-1, -1, 1), (1, 1, 1))]
    return np.concatenate([q, halves])


def test_a_pose_is_the_same_in_every_form() -> None:
    for rotation in rotations(200):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation, [1, -2, 3]
        pose = mrol.Pose.of(matrix)
        np.testing.assert_allclose(pose.matrix, matrix, atol=1e-9)
        assert np.linalg.norm(pose.rotation_xyzw) == pytest.approx(1)
        for form in (pose, pose.seven(), (pose.translation_m, pose.rotation_xyzw), matrix.astype("f4"), np.array(pose.seven())):
            np.testing.assert_allclose(mrol.Pose.of(form).matrix, matrix, atol=1e-6)
        np.testing.assert_allclose((pose @ pose.inverse()).matrix, np.eye(4), atol=1e-9)
        points = np.array([[1.0, 2.0, 3.0], [-1.0, 0.5, 0.0]])
        np.testing.assert_allclose(pose.apply(points), points @ rotation.T + [1, -2, 3], atol=1e-9)
    stack = np.tile(np.eye(4), (len(rotations(50)), 1, 1))
    stack[:, :3, :3] = rotations(50)
    sevens = sevens_of(stack.reshape(2, -1, 4, 4), "poses")
    assert sevens.shape == (2, 27, 7)
    for seven, matrix in zip(sevens.reshape(-1, 7), stack, strict=True):
        np.testing.assert_allclose(mrol.Pose.of(seven).matrix, matrix, atol=1e-9)


@pytest.mark.parametrize(
    "bad",
    [
        np.diag([1, 1, -1, 1]),
        np.diag([2, 1, 1, 1]),
        np.diag([1, 1, 1, 2]),
        np.full((4, 4), np.nan),
        np.zeros(6),
        np.zeros((3, 3)),
        [0, 0, 0, 1, 1, 1, 1],
        [np.inf, 0, 0, 0, 0, 0, 1],
        "here",
        None,
        ([0, 0, 0],),
        7,
    ],
)
def test_what_is_no_pose_is_refused(bad: object) -> None:
    with pytest.raises(mrol.ArgumentError, match="pose must be"):
        mrol.Pose.of(bad)


def test_the_parts_of_a_pose_are_not_swapped_unseen() -> None:
    turn, to = np.array([0, 0, 0, 1.0]), np.array([1, 2, 3.0])
    with pytest.raises(mrol.ArgumentError, match=r"translation_m must be .*, got shape \(4,\)"):
        mrol.Pose(turn, to)
    with pytest.raises(mrol.ArgumentError, match=r"pose must be .*, got shapes \(4,\) and \(3,\)"):
        mrol.Pose.of((turn, to))
    with pytest.raises(mrol.ArgumentError, match="rotation_xyzw must be a unit quaternion"):
        mrol.Pose(to, np.array([0, 0, 1, 1.0]))
    pose = mrol.Pose(to, turn)
    assert pose.seven() == [1, 2, 3, 0, 0, 0, 1]
    with pytest.raises(ValueError, match="read-only"):
        pose.translation_m[0] = 7
    with pytest.raises(mrol.ArgumentError, match="one Link or more"):
        mrol.Body([])


def test_packed_keys_are_three_signed_numbers() -> None:
    rng = np.random.default_rng(1)
    indices = rng.integers(-(1 << 20), 1 << 20, (1000, 3))
    packed = sum((indices[:, axis].astype(np.int64) & ((1 << 21) - 1)) << (21 * axis) for axis in range(3))
    assert indices_of(np.asarray(packed, np.int64).astype("<u8")).tolist() == indices.tolist()


def test_the_bits_of_a_block_are_in_morton_order() -> None:
    block = np.zeros(1, BLOCK)
    block["key"] = (-1 & ((1 << 21) - 1)) | 2 << 21
    for place in ((0, 0, 0), (2, 0, 0), (1, 3, 7)):
        bit = sum((place[axis] >> of & 1) << (3 * of + axis) for of in range(3) for axis in range(3))
        block["mask"][0, bit // 8] |= 1 << bit % 8
    assert sorted(map(tuple, voxels_of(block).tolist())) == [(-8, 16, 0), (-7, 19, 7), (-6, 16, 0)]


def test_messages_are_read_and_what_is_not_known_is_left_alone() -> None:
    text = bytes([0x0A, 2]) + b"hi"
    number = bytes([0x10, 0x96, 0x01])
    fixed = bytes([0x19]) + struct.pack("<d", 1.5)
    unknown = bytes([0xFD, 0x3E, 1, 2, 3, 4])
    packed = bytes([0x22, 3, 1, 0xAC, 0x02])
    below_zero = bytes([0x28]) + b"\xff" * 9 + b"\x01"
    message = Message(memoryview(text + number + fixed + unknown + packed + below_zero))
    assert (message.text(1), message.whole(2), message.double(3), message.wholes(4)) == ("hi", 150, 1.5, (1, 300))
    assert (message.signed(5), message.whole(9), message.text(9), message.flag(9)) == (-1, 0, "", False)
    for bad in (b"\x0a\x05hi", b"\xff" * 11, b"\x0b", b"\x19\x00", b"\x80"):
        with pytest.raises((ValueError, IndexError, struct.error)):
            Message(memoryview(bad))


@pytest.mark.parametrize(
    ("text", "tls", "expected"),
    [
        ("host", False, "http://host:7333"),
        ("host", True, "https://host:7333"),
        ("host:1", False, "http://host:1"),
        ("http://host:1", True, "http://host:1"),
        ("https://host/", False, "https://host:7333"),
        ("[::1]:80", False, "http://[::1]:80"),
        ("unix:/run/x.sock", False, "unix:/run/x.sock"),
        ("unix:///run/x.sock", False, "unix:/run/x.sock"),
    ],
)
def test_an_address_has_defaults(text: str, tls: bool, expected: str) -> None:
    assert str(Address.parse(text, tls)) == expected


def test_errors_survive_being_sent_to_another_process() -> None:
    refused = mrol.errors.server_error(409, "conflict", "scan_id_taken", "no", 1.5)
    lost = mrol.ConnectionLost("gone")
    lost.repeat_with = {"scan_id": 7}
    for error in (refused, lost, mrol.ArgumentError("a", "b", "c")):
        copy = pickle.loads(pickle.dumps(error))  # noqa: S301
        assert type(copy) is type(error)
        assert (str(copy), vars(copy)) == (str(error), vars(error))
    assert isinstance(lost, ConnectionError)
    assert isinstance(mrol.TimedOut("late"), TimeoutError)
    assert type(mrol.errors.server_error(418, "teapot", "short", "and stout")) is mrol.ServerError
