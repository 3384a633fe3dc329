"""What the node takes of a robot: python bench/node.py SECONDS [POINTS] [reliable|best_effort].

A simulated robot publishes clouds of 32 bytes a point at 10 Hz, with transforms at 50 Hz, to the node and, beside it, to a bare
subscriber. MROL_BINARY names the server. Printed are what became of the clouds, and the CPU time and the memory of the node.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.live.support import NodeProcess, Robot, Server, running, wait_until

BARE = """
import sys, signal, rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
rclpy.init()
node, got = rclpy.create_node("bare"), []
reliability = ReliabilityPolicy.RELIABLE if sys.argv[1] == "reliable" else ReliabilityPolicy.BEST_EFFORT
qos = QoSProfile(depth=2, reliability=reliability)
node.create_subscription(PointCloud2, "points", lambda message: got.append(message.header.stamp), qos)
end = []
signal.signal(signal.SIGTERM, lambda *_: end.append(1))
while not end:
    rclpy.spin_once(node, timeout_sec=0.1)
print(len(got))
"""


BEGIN_S = 300.0
"""Within so long the robot is mapped, however busy the machine is."""

SETTLED_S = 5.0
"""After so long all clouds were taken, and diagnostics say so."""


def cpu_s(pid):
    """CPU seconds of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_mib(pid):
    """Resident memory of a process."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def main(seconds, points, reliability):
    """Measures."""
    folder = Path(tempfile.mkdtemp())
    server = Server(folder)
    server.start()
    is_reliable = reliability == "reliable"
    robot = Robot(hz=10.0, points=points, reliable=is_reliable, has_times=True)
    node = NodeProcess(folder, server, robot="r1", clouds_reliable=is_reliable)
    with running(server, node, robot):
        robot.start()
        if is_reliable:
            wait_until(lambda: len(robot.poses) >= 3, BEGIN_S, "poses")
        else:
            # Of large clouds none may come whole.
            wait_until(lambda: robot.status("clouds") is not None, BEGIN_S, "diagnostics")
        robot.is_quiet = True
        bare = subprocess.Popen([sys.executable, "-c", BARE, reliability], stdout=subprocess.PIPE, text=True)
        wait_until(lambda: robot.listeners == 2, 30, "a bare subscriber")
        time.sleep(SETTLED_S)
        before, sent, used, begin_s, memory = counts(robot), robot.sent, cpu_s(node.pid), time.monotonic(), []
        robot.is_quiet = False
        while time.monotonic() < begin_s + seconds:
            time.sleep(1)
            memory.append(memory_mib(node.pid))
        used, took_s = cpu_s(node.pid) - used, time.monotonic() - begin_s
        robot.is_quiet = True
        time.sleep(SETTLED_S)
        after, sent = counts(robot), robot.sent - sent
        bare.terminate()
        of_bare = bare.communicate()[0].strip()
        print(
            f"{points} points of 32 bytes, {reliability}: {sent} clouds in {took_s:.1f} s, {of_bare} received by a bare subscriber"
        )
        print("node:", ", ".join(f"{after[name] - before[name]} {name}" for name in after))
        begin, middle, end = (f"{memory[at]:.0f}" for at in (0, len(memory) // 2, -1))
        print(f"{100 * used / took_s:.1f} % of a core; {begin} MiB at the begin, {middle} in the middle, {end} at the end")
        print("load of the machine: {:.1f} over a minute, {:.1f} over five".format(*os.getloadavg()))


def counts(robot):
    """What became of the clouds so far, by diagnostics."""
    values = robot.status("clouds")[2]
    names = ("received", "lost", "dropped", "accepted", "refused", "late", "not_sent", "without_times")
    return {name: int(values[name]) for name in names}


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 60_000, sys.argv[3] if len(sys.argv) > 3 else "reliable")
