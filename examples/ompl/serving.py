"""A server with maps to plan in, started for the experiment and the check: the building of `mrol demo`, and a hall."""

import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

HALL_RESOLUTION_M = 0.1
SCANS_OF_HALL = "balm_hall_consecutive"


@dataclass
class Server:
    """Where a server listens, and which maps it has."""

    http: str
    grpc: str
    maps: list[str]


@contextmanager
def server_with_maps(binary: str, shared_scans: Path) -> Iterator[Server]:
    """The demonstration's server once its robots are done; with the hall too where its scans are."""
    # A program that is told to end leaves no server behind.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by a signal"))
    command = [binary, "demo", "--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            server = _started(process)
            hall = shared_scans / SCANS_OF_HALL
            if hall.is_dir():
                _put_hall(binary, hall, server)
            yield server
        finally:
            process.terminate()


def _started(process: subprocess.Popen[str]) -> Server:
    said = ""
    assert process.stdout is not None
    for line in process.stdout:
        said += line
        if line.startswith("The daemon stays up"):
            addresses = re.search(r"HTTP (http://\S+), gRPC (http://\S+)", said)
            assert addresses is not None
            return Server(addresses[1], addresses[2], ["demo"])
    raise RuntimeError(f"the demonstration ended:\n{said}")


def _put_hall(binary: str, scans: Path, server: Server) -> None:
    """Makes a map of the hall's scans at their true poses, and gives it to the server."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "hall.mrol"
        options = ["--resolution", str(HALL_RESOLUTION_M), "--truth", str(scans / "poses.txt"), "--at-truth"]
        subprocess.run([binary, "map", str(scans), *options, "--out", str(file)], check=True, stdout=subprocess.DEVNULL)
        connection = HTTPConnection(urlsplit(server.http).netloc)
        headers = {"content-type": "application/octet-stream"}
        connection.request("PUT", "/v1/maps/hall/snapshot", file.read_bytes(), headers)
        answer = connection.getresponse()
        if answer.status >= 300:
            raise RuntimeError(f"the hall was not taken: {answer.status} {answer.read().decode(errors='replace')}")
    server.maps.append("hall")
