"""The map on the server, reached when it is needed."""

from __future__ import annotations

from threading import Lock

import mrol

from .options import Options


class ServerLink:
    """The map on the server. It is connected to when it is first used, since the server may come later. Threads may share it."""

    def __init__(self, options: Options, robot: str) -> None:
        self._options = options
        self._robot = robot
        self._lock = Lock()
        self._client: mrol.Client | None = None
        self._map: mrol.Map | None = None

    def map(self) -> mrol.Map:
        """The map, which is made where there is none and a `resolution` is set. No call of it is tried again by itself.

        Raises `mrol.MrolError`.
        """
        with self._lock:
            if self._map is None:
                self._map = self._found(self._connected())
            return self._map

    def forget_map(self) -> None:
        """Looks the map up again when it is next used: it was deleted, or made anew."""
        with self._lock:
            self._map = None

    def level(self) -> tuple[int, float]:
        """The level whose voxels have the side `resolution`, and their side; the finest without a `resolution`.

        Raises `mrol.MrolError`, also where the map has no such level.
        """
        levels = self.map().describe().levels
        wanted = self._options.resolution
        found = [of for of in levels if not wanted or abs(of.resolution_m / wanted - 1) < 1e-6]
        if not found:
            sides = ", ".join(f"{of.resolution_m:g}" for of in levels)
            raise mrol.MrolError(f"resolution must be the side of a voxel of the map, {sides} m, got {wanted:g}")
        return found[0].level, found[0].resolution_m

    def reset(self) -> None:
        """Deletes the map and makes it anew with the same settings.

        Raises `mrol.MrolError`.
        """
        info = self.map().describe()
        with self._lock:
            client = self._connected()
            self._map = None
            client.delete_map(info.name)
            self._map = client.map(
                info.name,
                resolution=info.resolution_m,
                levels=len(info.levels),
                filter=info.filter or "none",
                moments=info.moments,
                origin=info.origin_m,
                robot=self._robot,
            )

    def close(self) -> None:
        """Ends watches and connections."""
        client = self._client
        if client is not None:
            client.close()

    def _connected(self) -> mrol.Client:
        if self._client is None:
            options = self._options
            self._client = mrol.connect(
                options.server,
                key_file=options.key_file or None,
                ca=options.ca or None,
                timeout_s=options.request_timeout_s,
                # Who asks decides whether to ask again.
                patience_s=0,
            )
        return self._client

    def _found(self, client: mrol.Client) -> mrol.Map:
        name, resolution = self._options.map, self._options.resolution
        try:
            return client.map(name, robot=self._robot)
        except mrol.NotFound:
            if not resolution:
                raise
        return client.map(name, resolution=resolution, robot=self._robot)
