# The extension: see src/lib.rs. mrol.replica has all that it is called with checked, and knows what answers have.

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self, disjoint_base

__all__ = ["NativeBody", "NativeLocalMap", "NativeMap", "NativeReplica", "__version__", "set_exceptions"]

__version__: str

_F32: TypeAlias = NDArray[np.float32]
_Bools: TypeAlias = NDArray[np.bool_]
_Indices: TypeAlias = NDArray[np.int32]
_Version: TypeAlias = tuple[int, str, int | None]
_Fields: TypeAlias = dict[str, Any]
_Scope: TypeAlias = Mapping[str, Any] | None
_Corners: TypeAlias = tuple[list[float], list[float]]

def set_exceptions(
    failure: Callable[[str, str, str, str], BaseException], argument: Callable[[str, object, str], BaseException]
) -> None: ...

@disjoint_base
class NativeBody:
    def __new__(cls, links: list[_Fields]) -> Self: ...

@disjoint_base
class NativeMap:
    def close(self) -> None: ...
    def query(
        self, points: _F32, map_from_points: list[float] | None, lookup: str, keep_out: bool, scope: _Scope
    ) -> tuple[_Version, _Bools, int]: ...
    def poses(
        self,
        scope: _Scope,
        *,
        body: NativeBody,
        configurations: _F32,
        answer: str,
        clearance_max_m: float | None,
        ignored: list[_Fields] | None,
        unknown: str,
    ) -> _Fields: ...
    def spheres(
        self,
        scope: _Scope,
        *,
        spheres: _F32,
        sizes: NDArray[np.uint32] | None,
        padding_m: float,
        answer: str,
        clearance_max_m: float | None,
        ignored: list[_Fields] | None,
        unknown: str,
    ) -> _Fields: ...
    def motions(
        self,
        scope: _Scope,
        *,
        body: NativeBody,
        configurations: _F32,
        lengths: NDArray[np.uint32],
        step_m: float | None,
        clearance_max_m: float | None,
        ignored: list[_Fields] | None,
        unknown: str,
    ) -> _Fields: ...
    def motion_is_free(
        self, body: NativeBody, configurations: _F32, *, unknown_is_occupied: bool = False, scope: _Scope = None
    ) -> bool: ...
    def rays(
        self,
        scope: _Scope,
        *,
        origins: _F32,
        directions: _F32 | None = None,
        ends: _F32 | None = None,
        range_m: float | None,
        unknown: str,
    ) -> _Fields: ...
    def nearest(self, scope: _Scope, *, points: _F32, radius_m: float, to: str) -> _Fields: ...
    def classification(self, scope: _Scope, *, points: _F32) -> _Fields: ...
    def frontiers(
        self, scope: _Scope, *, box: _Fields, size_min: int | None, frontiers_max: int | None, standoff_m: float | None
    ) -> _Fields: ...
    def grid(
        self,
        scope: _Scope,
        *,
        area: _Fields | None,
        min_z_m: float | None,
        max_z_m: float | None,
        band_from: str,
        cell_m: float | None,
        tell_unknown: bool,
    ) -> _Fields: ...

@final
class NativeReplica(NativeMap):
    def __new__(
        cls,
        address: str,
        map: str,
        *,
        key: str | None,
        ca: bytes | None,
        certificate: bytes | None,
        private_key: bytes | None,
        timeout_s: float,
        silence_s: float | None,
        region: _Corners | None,
        blocks_max: int | None,
        bloom: bool,
        viewpoints: bool,
        age_max_s: float | None,
    ) -> NativeReplica: ...
    def status(self) -> tuple[_Version, int, bool, int, str | None, float, bool]: ...
    def check_age(self, age_max_s: float) -> None: ...
    def wait_for_revision(self, revision: int, timeout_s: float) -> None: ...

@final
class NativeLocalMap(NativeMap):
    def __new__(cls, resolution_m: float, levels: int, has_filter: bool, has_moments: bool) -> NativeLocalMap: ...
    @staticmethod
    def of_file(file: bytes) -> NativeLocalMap: ...
    def to_file(self) -> bytes: ...
    def map_scan(self, points: _F32, fields: _Fields, is_inserted: bool) -> _Fields: ...
    def localize(
        self,
        points: _F32,
        gravity_in_sensor: list[float] | None,
        gravity_in_map: list[float] | None,
        search_box: _Corners | None,
        time_limit_s: float | None,
        candidates: int,
        seed: int,
    ) -> _Fields: ...
    def voxels(self, level: int, region: _Fields | None) -> tuple[_Indices, float, _Version]: ...
    def delete(self, region: _Fields, level: int) -> tuple[int, _Version]: ...
