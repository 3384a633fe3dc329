# The extension: see src/lib.rs.

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

F32: TypeAlias = NDArray[np.float32]
I64: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]
Indices: TypeAlias = NDArray[np.int32]
Names: TypeAlias = list[str | None] | None
Told: TypeAlias = tuple[int, str, str | None]
Regions: TypeAlias = list[tuple[str, list[float]]]
Corners: TypeAlias = tuple[list[float], list[float]]
Checked: TypeAlias = tuple[Bools, int, tuple[I64, I64, Indices, Names] | None, tuple[F32, I64] | None, Told]

class NativeBody:
    def __new__(cls, links: list[tuple[F32, F32, float]]) -> Self: ...
    @property
    def links(self) -> int: ...

class Questions:
    def close(self) -> None: ...
    def query(
        self, points: F32, map_from_points: list[float] | None, level: int, bloom: bool, keep_out: bool
    ) -> tuple[Bools, int, Told]: ...
    def check_poses(
        self,
        body: NativeBody,
        configurations: F32,
        answer: str,
        clearance_max_m: float | None,
        ignored: Regions,
        unknown_is_occupied: bool,
        level: int,
        ignore_keep_outs: bool,
    ) -> Checked: ...
    def check_spheres(
        self,
        spheres: F32,
        sizes: NDArray[np.uint32],
        padding_m: float,
        answer: str,
        clearance_max_m: float | None,
        ignored: Regions,
        unknown_is_occupied: bool,
        level: int,
        ignore_keep_outs: bool,
    ) -> Checked: ...
    def check_motions(
        self,
        body: NativeBody,
        configurations: F32,
        lengths: NDArray[np.uint32],
        step_m: float | None,
        clearance_max_m: float | None,
        ignored: Regions,
        unknown_is_occupied: bool,
        level: int,
        ignore_keep_outs: bool,
    ) -> tuple[Bools, int, F32, F32 | None, Told]: ...
    def motion_is_free(
        self,
        body: NativeBody,
        configurations: F32,
        *,
        level: int = 0,
        unknown_is_occupied: bool = False,
        ignore_keep_outs: bool = False,
    ) -> bool: ...
    def cast_rays(
        self,
        origins: F32,
        toward: F32,
        are_ends: bool,
        range_m: float | None,
        unknown_is_occupied: bool,
        level: int,
        ignore_keep_outs: bool,
    ) -> tuple[Bools, int, F32, Indices, Names, Told]: ...
    def nearest(
        self, points: F32, radius_m: float, to_centers: bool, level: int, ignore_keep_outs: bool
    ) -> tuple[Bools, F32, Indices, F32, Names, Told]: ...
    def classify(self, points: F32, level: int, ignore_keep_outs: bool) -> tuple[Bools, Bools, Told]: ...

class NativeReplica(Questions):
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
        region: Corners | None,
        blocks_max: int | None,
        bloom: bool,
        viewpoints: bool,
        age_max_s: float | None,
    ) -> NativeReplica: ...
    def status(self) -> tuple[Told, int, bool, int, str | None, float, bool]: ...
    def check_age(self, age_max_s: float) -> None: ...
    def wait_for_revision(self, revision: int, timeout_s: float) -> None: ...

class NativeLocalMap(Questions):
    def __new__(cls, resolution_m: float, levels: int, has_filter: bool, has_moments: bool) -> NativeLocalMap: ...
    @staticmethod
    def of_file(file: bytes) -> NativeLocalMap: ...
    def to_file(self) -> bytes: ...
    def map_scan(self, points: F32, fields: dict[str, Any], is_inserted: bool) -> dict[str, Any]: ...
    def localize(
        self,
        points: F32,
        gravity_in_sensor: list[float] | None,
        gravity_in_map: list[float] | None,
        search_box: Corners | None,
        time_limit_s: float | None,
        candidates: int,
        seed: int,
    ) -> dict[str, Any]: ...
    def voxels(self, level: int, region: tuple[str, list[float]] | None) -> tuple[Indices, float, Told]: ...
    def delete(self, region: tuple[str, list[float]], level: int) -> tuple[int, Told]: ...
