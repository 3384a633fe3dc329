"""What diagnostics tell of the mapper."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Counts:
    """What became of the clouds so far."""

    accepted: int = 0
    refused: int = 0
    """Those that did not fit: the map is untouched."""
    unreadable: int = 0
    late: int = 0
    """Those whose stamp is not later than that of the one before."""
    not_sent: int = 0
    """Those that the server could not be reached for, or would not take."""
    repeated: int = 0
    """Requests that were sent again since their answer was lost."""
    failed: int = 0
    """Those at which the node itself failed: a defect, which the log has."""
    paused: int = 0
    without_odometry: int = 0
    without_times: int = 0


@dataclass
class MapperState:
    """What diagnostics tell of the mapper."""

    counts: Counts = field(default_factory=Counts)
    verdict: str = ""
    """Of the last answer."""
    reason: str = ""
    server_error: str = ""
    """Why the last request had no answer; empty while the server answers."""
    left_out: str = ""
    """Why the last cloud of those was left out that could not be read, or were not taken."""
    missing: str = ""
    """What is missing for a better guess."""
    needs_pose: bool = False
    """The server knows no pose of the robot in a map that is not empty."""
    times: str = ""
    """How times of points are read, or why there are none."""
