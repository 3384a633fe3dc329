"""`python -m mrol`: how to start."""

import argparse
import sys

from . import ArgumentError, MrolError, __version__, connect

START = """\
mrol {version}: the 3-D map of a robot fleet, from Python.

Start a server, in another terminal:

    mrol serve                  HTTP on localhost:7333 (gRPC, which this package does not speak, on 7334);
                                `mrol demo` serves a map to ask about as well

Then:

    import mrol, numpy as np

    m = mrol.connect("localhost:7333").map("first-steps", resolution=0.05)
    m.insert(np.random.rand(1000, 3), align=False)
    print(m.query([[0.5, 0.5, 0.5], [9, 9, 9]]).occupied)

A map inside this process, without a request for each question or without any server: mrol.replica, by an extension.

help(mrol.connect) tells of keys, TLS and time-outs, help(mrol.Map) all that can be asked of a map.
`python -m mrol ADDRESS` lists the maps of a server; MROL_KEY_FILE names a file with a key.
"""


def main() -> int:
    """Prints how to start, or what maps a server has; 1 where it cannot be asked, 2 for what is no address."""
    parser = argparse.ArgumentParser(prog="python -m mrol", description="Prints how to start, or the maps of a server.")
    parser.add_argument("address", nargs="?", help="host:port, https://host:port or unix:/path")
    address = parser.parse_args().address
    if address is None:
        print(START.format(version=__version__), end="")
        return 0
    try:
        with connect(address) as client:
            for of in client.maps().maps:
                print(f"{of.name}: revision {of.revision}, {of.scans} scans, {of.voxels[0]} voxels of {of.resolution_m:g} m")
    except MrolError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2 if isinstance(error, ArgumentError) else 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
