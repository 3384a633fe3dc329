"""The real program, started on free ports of loopback."""

import json
import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import mrol

START_MAX_S = 30.0


def binary() -> str:
    """The program that is tested, of the variable MROL_BINARY."""
    found = os.environ.get("MROL_BINARY")
    if not found or not Path(found).exists():
        raise RuntimeError("MROL_BINARY must name the program: clients/python/check BINARY sets it")
    return found


class Server:
    """A server that can be ended and started again at the same address."""

    def __init__(self, folder: Path, *options: str) -> None:
        self._options = options
        self._folder = folder
        self._process: subprocess.Popen[str] | None = None
        self.address = "127.0.0.1:0"
        self.grpc = "127.0.0.1:0"

    def start(self) -> None:
        """Starts it, and waits until it takes requests."""
        command = [binary(), "serve", "--json", "--log-level", "warn", "--data-dir", str(self._folder / "data")]
        listen = ["--http-listen", self.address, "--grpc-listen", self.grpc]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("MROL_")}
        with (self._folder / "log").open("a") as log:
            self._process = subprocess.Popen(
                [*command, *listen, *self._options], stdout=subprocess.PIPE, stderr=log, text=True, env=environment
            )
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the server did not start:\n{(self._folder / 'log').read_text()}")
        addresses = json.loads(line)
        self.address, self.grpc = addresses["http"], addresses["grpc"]

    def kill(self) -> None:
        """Ends it as the loss of power would."""
        self._end(signal.SIGKILL)

    def stop(self) -> None:
        """Tells it to end, and waits until it has."""
        self._end(signal.SIGTERM)

    def _end(self, how: signal.Signals) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        process.send_signal(how)
        process.wait(START_MAX_S)
        assert process.stdout is not None
        process.stdout.close()


@contextmanager
def serving(folder: Path, *options: str) -> Iterator[Server]:
    """A server for a while."""
    server = Server(folder, *options)
    try:
        server.start()
        yield server
    finally:
        server.kill()


def run(*arguments: str, cwd: Path | None = None) -> str:
    """What a command of the program prints."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("MROL_")}
    done = subprocess.run([binary(), *arguments], capture_output=True, text=True, check=True, cwd=cwd, env=environment)
    return done.stdout


def scan_ids(m: mrol.Map) -> Sequence[tuple[str, int | None]]:
    """Session and id of each scan that a map has."""
    return [(scan.session, scan.scan_id) for scan in m.trajectory().scans]
