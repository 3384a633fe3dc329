"""Pictures of plans: over the map as it looks from above and aside, and over its projected grid."""

from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from batches import places_along
from checker import Places
from server import ServedMap, bits

matplotlib.use("Agg")
from matplotlib import colors, pyplot  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402

HEIGHTS = colors.LinearSegmentedColormap.from_list("heights", ["#1f3a4d", "#20776f", "#7fa05a", "#d9c26a"])
BACKGROUND = 0.98
GRID_COLORS = colors.ListedColormap(["#ffffff", "#1f3a4d"])
PIXELS_WIDE = 900
PALETTE_COLORS = 96
PATH_DOTS = 600
MARGIN_M = 0.3
HEIGHT_INCHES = 5.0
DOTS_PER_INCH = 90


@dataclass
class Style:
    """How a path is drawn."""

    label: str
    color: str
    width: float

    def line(self) -> dict[str, Any]:
        """Where it is seen."""
        return {"color": self.color, "linewidth": self.width, "solid_capstyle": "round"}

    def faint(self) -> dict[str, Any]:
        """Where the map hides it."""
        return {"color": self.color, "linewidth": self.width * 0.6, "linestyle": (0, (1, 2))}


FOUND = Style("as the planner found it", "#ff9e1b", 1.6)
SHORTENED = Style("shortened", "#e4002b", 2.6)


@dataclass
class View:
    """A parallel projection from above: the map is turned about the vertical, then tipped."""

    turn_deg: float
    tip_deg: float

    def project(self, places: Places) -> tuple[Places, NDArray[np.float64]]:
        """Where places are in the picture (right and up, in meters), and how near to the viewer."""
        turn, tip = np.radians(self.turn_deg), np.radians(self.tip_deg)
        right = places[:, 0] * np.cos(turn) - places[:, 1] * np.sin(turn)
        back = places[:, 0] * np.sin(turn) + places[:, 1] * np.cos(turn)
        up = back * np.sin(tip) + places[:, 2] * np.cos(tip)
        near = places[:, 2] * np.sin(tip) - back * np.cos(tip)
        return np.stack([right, up], 1), near


class Rendering:
    """An image of voxels in a view, with the depth of each pixel."""

    def __init__(self, centers: Places, side_m: float, view: View, shown: Places) -> None:
        self.view = view
        flat, near = view.project(centers)
        all_shown = np.concatenate([flat, view.project(shown)[0]])
        self.corner = all_shown.min(0) - MARGIN_M
        across, up = all_shown.max(0) + MARGIN_M - self.corner
        self.pixel_m = float(across) / PIXELS_WIDE
        size = np.ceil(np.array([across, up]) / self.pixel_m).astype(int)
        self.depth = np.full(size[::-1], -np.inf)
        heights = np.full(size[::-1], np.nan)
        order = np.argsort(near)
        across, up = self._pixels(flat[order]).T
        reach = int(np.ceil(side_m * 1.2 / self.pixel_m / 2))
        # Where several voxels fall on a pixel, the last assignment counts: that of the nearest one.
        layers = [(x, y) for x in range(-reach, reach + 1) for y in range(-reach, reach + 1)]
        rows = np.concatenate([up + y for _, y in layers]).clip(0, size[1] - 1)
        columns = np.concatenate([across + x for x, _ in layers]).clip(0, size[0] - 1)
        nears, tops = np.tile(near[order], len(layers)), np.tile(centers[order, 2], len(layers))
        order = np.argsort(nears, kind="stable")
        self.depth[rows[order], columns[order]] = nears[order]
        heights[rows[order], columns[order]] = tops[order]
        self.image = self._shaded(heights)

    def is_visible(self, places: Places) -> NDArray[np.bool_]:
        """Whether nothing of the map hides places."""
        flat, near = self.view.project(places)
        column, row = self._pixels(flat).T
        rows, columns = self.depth.shape
        return near >= self.depth[row.clip(0, rows - 1), column.clip(0, columns - 1)]

    def pixels(self, places: Places) -> Places:
        """Where places are in the image: column and row."""
        return (self.view.project(places)[0] - self.corner) / self.pixel_m

    def _pixels(self, flat: Places) -> NDArray[np.int64]:
        return ((flat - self.corner) / self.pixel_m).astype(int)

    def _shaded(self, heights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Colors by height, darker where neighbors are nearer: edges and corners stand out."""
        low, high = np.nanpercentile(heights, [2, 98])
        image = HEIGHTS((heights - low) / max(high - low, 1e-9))[:, :, :3]
        known = np.isfinite(self.depth)
        depth = np.where(known, self.depth, self.depth[known].min())
        shade = np.zeros_like(depth)
        for step in (1, 3):
            for axis in (0, 1):
                for way in (-step, step):
                    shade += np.clip(np.roll(depth, way, axis) - depth, 0, 40 * self.pixel_m) / self.pixel_m
        image *= np.exp(-0.012 * shade)[:, :, None]
        image[~known] = BACKGROUND
        return image


def draw(served: ServedMap, paths: tuple[Places, Places], file: str, view: View, cut_m: float) -> None:
    """Writes a picture of a path, as it was found and as it was shortened.

    On the left it runs through the voxels below a height, on the right over the grid of the heights where it runs.
    """
    centers = (served.voxels() + 0.5) * served.resolution_m
    low, high = np.percentile(centers, [0.5, 99.5], axis=0) + np.array([[-MARGIN_M], [MARGIN_M]])
    centers = centers[((centers >= low) & (centers <= [high[0], high[1], min(high[2], cut_m)])).all(1)]
    rendering = Rendering(centers, served.resolution_m, view, np.concatenate(paths))
    rows, columns = rendering.depth.shape
    across, up = high[:2] - low[:2]
    ratios = [columns / rows, across / up]
    size = (HEIGHT_INCHES * sum(ratios), HEIGHT_INCHES)
    figure, axes = pyplot.subplots(1, 2, figsize=size, width_ratios=ratios, layout="constrained")
    figure.set_facecolor((BACKGROUND, BACKGROUND, BACKGROUND))
    _draw_voxels(axes[0], rendering, paths)
    _draw_grid(axes[1], served, (low, high), paths)
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    figure.savefig(file, dpi=DOTS_PER_INCH, bbox_inches="tight", pad_inches=0.08)
    pyplot.close(figure)
    with Image.open(file) as picture:
        picture.convert("RGB").quantize(PALETTE_COLORS, dither=Image.Dither.NONE).save(file, optimize=True)


def _draw_voxels(axes: Axes, rendering: Rendering, paths: tuple[Places, Places]) -> None:
    axes.imshow(rendering.image, origin="lower", interpolation="antialiased")
    axes.set_autoscale_on(False)
    for path, style in zip(paths, (FOUND, SHORTENED)):
        places = places_along(path, PATH_DOTS)
        columns, rows = rendering.pixels(places).T
        visible = rendering.is_visible(places)
        axes.plot(columns, rows, **style.faint())
        axes.plot(np.where(visible, columns, np.nan), rows, **style.line())
    _mark_ends(axes, rendering.pixels(paths[1]))
    axes.set_axis_off()


def _draw_grid(axes: Axes, served: ServedMap, box: tuple[Places, Places], paths: tuple[Places, Places]) -> None:
    heights = paths[1][:, 2]
    band = {"min_z_m": float(heights.min()), "max_z_m": float(heights.max()), "band_from": "map"}
    area = {"min_m": box[0][:2].tolist(), "max_m": box[1][:2].tolist()}
    head, raw = served.ask("grid", {"area": area} | band)
    columns, rows = head["size"]
    occupied = bits(head, raw, "occupied", rows * columns).reshape(rows, columns)
    (left, low), cell_m = head["origin_m"], head["cell_m"]
    extent = (left, left + columns * cell_m, low, low + rows * cell_m)
    axes.imshow(occupied, cmap=GRID_COLORS, origin="lower", extent=extent, interpolation="antialiased")
    for path, style in zip(paths, (FOUND, SHORTENED)):
        axes.plot(path[:, 0], path[:, 1], label=style.label, **style.line())
    _mark_ends(axes, paths[1][:, :2])
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7)
    axes.yaxis.tick_right()


def _mark_ends(axes: Axes, path: Places) -> None:
    axes.plot(*path[0], "o", color="white", markeredgecolor=SHORTENED.color, markeredgewidth=2, markersize=7)
    axes.plot(*path[-1], "o", color=SHORTENED.color, markeredgecolor="white", markeredgewidth=1.2, markersize=8)
