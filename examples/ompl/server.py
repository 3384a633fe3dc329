"""A map of a server, asked over HTTP: the form for programs, over one connection that is kept."""

import json
import struct
from http.client import HTTPConnection
from typing import Any
from urllib.parse import urlencode, urlsplit

import numpy as np
from numpy.typing import NDArray

from checker import Bools, Places, padding_between_checks

Answer = tuple[dict[str, Any], memoryview]


class ServedMap:
    """A map by its name, at a server such as `http://127.0.0.1:7333`."""

    def __init__(self, address: str, name: str) -> None:
        self.connection = HTTPConnection(urlsplit(address).netloc, timeout=30)
        self.name = name
        self.path = f"/v1/maps/{name}"
        description = self.get("")
        self.resolution_m: float = description["settings"]["resolution_m"]

    def close(self) -> None:
        """Closes the connection."""
        self.connection.close()

    def get(self, what: str, **parameters: Any) -> Any:
        """What the map tells in JSON at `/v1/maps/NAME/what`."""
        return json.loads(self._request("GET", f"{self.path}{what}?{urlencode(parameters)}", None, {}))

    def ask(self, question: str, head: dict[str, Any], **arrays: NDArray[Any]) -> Answer:
        """The answer to a question whose arrays go as bytes: its head, and the bytes of its arrays."""
        raw = b""
        for name, array in arrays.items():
            data = array.tobytes()
            head = head | {name: {"at": len(raw), "bytes": len(data)}}
            raw += data
        text = json.dumps(head).encode()
        body = struct.pack("<I", len(text)) + text + raw
        headers = {"content-type": "application/octet-stream"}
        answer = memoryview(self._request("POST", f"{self.path}/{question}", body, headers))
        (length,) = struct.unpack_from("<I", answer)
        return json.loads(bytes(answer[4 : 4 + length])), answer[4 + length :]

    def voxels(self, level: int = 0) -> NDArray[np.int64]:
        """All occupied voxels of a level, rows of i j k."""
        return np.array(self.get("/voxels", level=level)["voxels"], np.int64).reshape(-1, 3)

    def sensor_places(self) -> Places:
        """Where the scans were taken that made the map."""
        poses = self.get("/trajectory")["poses"]
        return np.array([pose["map_from_sensor"]["translation_m"] for pose in poses])

    def rays_are_free(self, origins: Places, ends: Places) -> Bools:
        """Whether nothing is in the way from each origin to its end."""
        points = {"origins": origins.astype("<f4"), "ends": ends.astype("<f4")}
        head, raw = self.ask("rays", {}, **points)
        return ~bits(head, raw, "hit", len(ends))

    def _request(self, method: str, path: str, body: bytes | None, headers: dict[str, str]) -> bytes:
        self.connection.request(method, path, body, headers)
        answer = self.connection.getresponse()
        said = answer.read()
        if answer.status != 200:
            raise RuntimeError(f"{method} {path}: {answer.status} {said.decode(errors='replace')}")
        return said


class ServerChecker:
    """Checks a body by requests: each call is one `CheckPoses` or one `CheckMotions`."""

    def __init__(self, served: ServedMap, spheres: NDArray[np.float32]) -> None:
        self.served = served
        padding_m = padding_between_checks(served.resolution_m / 2)
        self.body = {"body": {"links": [{"spheres": spheres.tolist(), "padding_m": padding_m}]}}

    def places_fit(self, places: Places) -> Bools:
        head, raw = self.served.ask("poses", self.body, configurations=configurations(places))
        return ~bits(head, raw, "colliding", len(places))

    def motions_fit(self, motions: Places) -> Bools:
        arrays = {"configurations": configurations(motions), "lengths": np.full(len(motions), 2, "<u4")}
        head, raw = self.served.ask("motions", self.body, **arrays)
        return bits(head, raw, "free", len(motions))


def configurations(places: Places) -> NDArray[np.float32]:
    """Poses x y z qx qy qz qw of a body of one link that does not turn."""
    poses = np.zeros((places.size // 3, 7), "<f4")
    poses[:, :3] = places.reshape(-1, 3)
    poses[:, 6] = 1
    return poses


def bits(head: dict[str, Any], raw: memoryview, name: str, count: int) -> Bools:
    """An array of bits of an answer."""
    at, length = head[name]["at"], head[name]["bytes"]
    packed = np.frombuffer(raw[at : at + length], np.uint8)
    return np.unpackbits(packed, count=count, bitorder="little").view(np.bool_)
