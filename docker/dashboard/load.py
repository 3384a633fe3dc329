"""Servers that have something to say on every panel: one with keys, TLS, a map that cannot be opened, and callers of all
kinds; and a node of a cluster."""

import http.client
import json
import os
import random
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

# More than the load below asks for in a second, and less than its burst does.
REQUESTS_PER_S_MAX = 40
BURST = 120
MAP = "/v1/maps/hall"


class Server:
    """A server of one's own, on free ports of this machine."""

    def __init__(self, binary, folder):
        self.folder = Path(folder)
        self.keys = {name: self._new_key(binary, name, scope) for name, scope in KEYS.items()}
        self.certificate = self._new_certificate()
        data = self.folder / "data"
        (data / "maps").mkdir(parents=True)
        (data / "maps" / "broken.mrol").write_text("not a map")
        environment = dict(
            os.environ,
            MROL_STORE__SNAPSHOT_INTERVAL_S="3",
            MROL_LIMITS__CALLER_REQUESTS_PER_S_MAX=str(REQUESTS_PER_S_MAX),
            MROL_LIMITS__CALLER_BURST_MAX=str(REQUESTS_PER_S_MAX),
        )
        self.process, self.address = self.start(binary, data, environment)

    def start(self, binary, data, environment):
        """Starts a server with the keys and the certificate of this one: its process and its address."""
        options = ["--json", "--data-dir", data, "--keys-file", self.folder / "keys.toml"]
        options += ["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"]
        options += ["--tls-certificate", self.certificate, "--tls-key", self.folder / "tls.key"]
        log = data.with_suffix(".log")
        with log.open("w") as file:
            process = subprocess.Popen(
                [binary, "serve", *options], stdout=subprocess.PIPE, stderr=file, env=environment, text=True
            )
        first = process.stdout.readline()
        if not first:
            sys.exit(f"the server ended:\n{log.read_text()}")
        return process, json.loads(first)["http"].split("//")[-1]

    def _new_key(self, binary, name, scope):
        command = [binary, "key", "new", "--name", name, "--scope", scope, "--file", self.folder / "keys.toml"]
        secret = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
        file = self.folder / f"{name}.key"
        file.write_text(secret)
        return secret

    def _new_certificate(self):
        file = self.folder / "tls.pem"
        command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "5", "-subj", "/CN=localhost"]
        command += ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", self.folder / "tls.key", "-out", file]
        subprocess.run(command, check=True, capture_output=True)
        return file

    def connection(self, address=None):
        context = ssl.create_default_context(cafile=self.certificate)
        return http.client.HTTPSConnection(address or self.address, timeout=60, context=context)


# Names and scopes of the keys. Limits count by key: the noisy caller's burst leaves the others alone.
KEYS = {"operator": "admin", "noisy": "read", "prometheus": "read"}


@contextmanager
def server_under_load(binary, folder):
    """The server and its load, while callers ask; afterwards the load has to have ended without a failure."""
    # A check that is told to end leaves no server behind.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by a signal"))
    server = Server(binary, folder)
    load = Load(server)
    try:
        load.begin()
        yield server, load
        load.end()
    finally:
        load.stopped.set()
        server.process.terminate()
        server.process.wait()


@contextmanager
def node_of_a_cluster(binary, nats_program, server):
    """A node with the keys and the certificate of the server, that leads a map by way of one NATS server: its address."""
    folder = server.folder
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    conf = f'listen: "127.0.0.1:{port}"\njetstream {{ store_dir: "{folder}/nats", sync_interval: always }}\n'
    (folder / "nats.conf").write_text(conf)
    command = [nats_program, "--config", folder / "nats.conf", "--log", folder / "nats.log"]
    processes = [subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)]
    try:
        (folder / "cluster.secret").write_text("a secret of the check, and of nobody else".replace(" ", "-"))
        environment = dict(
            os.environ,
            MROL_CLUSTER__NATS=f'["nats://127.0.0.1:{port}"]',
            MROL_CLUSTER__NODE="n1",
            MROL_CLUSTER__SECRET_FILE=str(folder / "cluster.secret"),
            MROL_CLUSTER__REPLICAS="1",
        )
        process, address = server.start(binary, folder / "node", environment)
        processes.append(process)
        ask = asking_of(server.connection(address), server.keys["operator"])
        deadline = time.monotonic() + 30
        scan = _body("mower", [[1.0, 2.0, 0.5]], (0.0, 0.0)) | {"align": False}
        for method, path, body in [
            ("GET", "/readyz", None),
            ("PUT", "/v1/maps/yard", {"resolution_m": 0.2}),
            ("POST", "/v1/maps/yard/scans", scan),
        ]:
            # A NATS server that has just begun refuses for a while.
            while (answer := ask(method, path, body))[0] not in (200, 201):
                if answer[0] != 503 or time.monotonic() > deadline:
                    sys.exit(f"{method} {path} of the node: {answer}\n{(folder / 'node.log').read_text()}")
                time.sleep(0.2)
        stopped = threading.Event()
        mower = threading.Thread(target=scan_until, args=(stopped, ask, scan), daemon=True)
        mower.start()
        yield address
        stopped.set()
        mower.join(60)
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait()


def scan_until(stopped, ask, scan):
    """Sends a scan to the node every second, so that NATS has something to acknowledge."""
    while not stopped.wait(1):
        status, text = ask("POST", "/v1/maps/yard/scans", scan)
        if status != 200:
            print(f"the node refused a scan: {status} {text}")


def asking_of(connection, secret):
    """A function that asks over this connection: the status and the text of the answer."""

    def ask(method, path, body=None):
        headers = {"content-type": "application/json", "authorization": f"Bearer {secret}"}
        connection.request(method, path, body and json.dumps(body), headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode(errors="replace")

    return ask


class Load:
    """Robots, a planner, an operator, a watcher and a noisy caller, until told to stop."""

    def __init__(self, server):
        self.server = server
        self.stopped = threading.Event()
        self.failures = []
        self.random = random.Random(1)
        self.connections = {name: server.connection() for name in ("operator", "noisy", "stranger")}

    def begin(self):
        self._ask("PUT", MAP, {"resolution_m": 0.2}, expected=201)
        self._scan("first", _room(self.random, (0.0, 0.0), 12_000))
        self.watcher = self.server.connection()
        self.watcher.request("GET", f"{MAP}/watch", headers=self._headers("operator"))
        assert self.watcher.getresponse().status == 200
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def end(self):
        self.stopped.set()
        self.thread.join(60)
        self.watcher.close()
        if self.thread.is_alive():
            sys.exit("a caller waits for its answer")
        self.must_be_well()

    def must_be_well(self):
        """Ends the check where a caller was not answered as it should be."""
        if self.failures:
            sys.exit(f"the load failed: {self.failures}")

    def _run(self):
        try:
            step = 0
            while not self.stopped.wait(0.5):
                self._step(step)
                step += 1
        except Exception as failure:
            self.failures.append(repr(failure))

    def _step(self, step):
        place = (0.05 * (step % 8), 0.0)
        fits = self._scan("follower", _room(self.random, place), place)
        if step == 0 and not fits["accepted"]:
            raise RuntimeError(f"the scan is not accepted: {fits}")
        lost = self._scan("lost", [[self.random.uniform(-9, 9) for _ in range(3)] for _ in range(800)])
        if lost["accepted"]:
            raise RuntimeError(f"noise is accepted: {lost}")
        self._ask("POST", f"{MAP}/alignment", _body("follower", _room(self.random, place), place))
        points = [[self.random.uniform(-4, 4) for _ in range(3)] for _ in range(2000)]
        for lookup in ("exact", "bloom"):
            self._ask("POST", f"{MAP}/occupancy", {"points": points, "lookup": lookup})
        done = self._ask("POST", f"{MAP}/deletions", {"box": {"min_m": [3, -1, -1], "max_m": [5, 1, 1]}})
        self._ask("POST", f"{MAP}/undo", {"revision": done["revision"]})
        for _ in range(BURST if step % 4 == 0 else 0):
            self._ask("GET", MAP, caller="noisy", expected=None)
        for _ in range(4):
            self._ask("GET", MAP, caller="stranger", expected=401)

    def _scan(self, robot, points, place=(0.0, 0.0)):
        return self._ask("POST", f"{MAP}/scans", _body(robot, points, place))

    def _headers(self, caller):
        secret = self.server.keys.get(caller, "a key that nobody made")
        return {"content-type": "application/json", "authorization": f"Bearer {secret}"}

    def _ask(self, method, path, body=None, caller="operator", expected=200):
        connection = self.connections[caller]
        connection.request(method, path, body and json.dumps(body), self._headers(caller))
        answer = connection.getresponse()
        text = answer.read()
        if expected is not None and answer.status != expected:
            raise RuntimeError(f"{method} {path}: {answer.status} {text.decode(errors='replace')}")
        return json.loads(text)


def _body(robot, points, place):
    pose = {"translation_m": [*place, 0.0], "rotation_xyzw": [0, 0, 0, 1]}
    return {"robot": robot, "points": points, "guess": pose}


def _room(source, place, count=4_000):
    """Points on the floor, the walls and a pillar of a room of 8 x 6 x 3 m, as seen from `place`."""
    points = []
    for _ in range(count):
        x, y, z = source.uniform(-4, 4), source.uniform(-3, 3), source.uniform(-1, 2)
        surfaces = [(x, y, -1.0), (-4.0, y, z), (4.0, y, z), (x, -3.0, z), (x, 3.0, z), (1.5 + x / 16, 1.0, z)]
        x, y, z = source.choice(surfaces)
        points.append([x - place[0], y - place[1], z])
    return points
