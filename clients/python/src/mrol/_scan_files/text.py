"""Points in lines of text."""

from dataclasses import dataclass

import numpy as np

from .._arrays import F64
from .axes import AxisMissing, Columns, axes_of
from .lines import Lines, check_text, comment, content, is_content, read_each, text_of, words_of
from .numbers import not_a_number, number, plain_rows, whole
from .problem import Problem

FIRST_COLUMNS: Columns = (0, 1, 2)
"""Columns of x, y and z where no line of names says others."""


def points_of(data: bytes, columns: Columns | None = None) -> F64:
    """The points of a text: x y z are the first three columns, those that a line of names before them says, or the given ones."""
    check_text(data)
    lines = Lines(data)
    head = _take_head(lines)
    columns = head.columns if columns is None else columns
    points = _at_once(lines, columns)
    if points is None:
        points = _line_by_line(lines, columns)
    if head.declared is not None and head.declared != len(points):
        declared = f"{head.declared} points are declared, {len(points)} follow: the file is truncated"
        raise Problem(declared, head.line_of_declared)
    return points


def _at_once(lines: Lines, columns: Columns) -> F64 | None:
    start = lines.copy()
    first = next((line for _, line in start if is_content(line)), b"")
    if b";" in first:
        # A comma may be the decimal point.
        return None
    return plain_rows(lines, columns, separator="," if b"," in first else None)


def _line_by_line(lines: Lines, columns: Columns) -> F64:
    points = read_each(content(lines), lambda text: _point(text, columns))
    return np.array(points, np.float64).reshape(-1, 3)


@dataclass
class _Head:
    """What the lines before the first point say."""

    columns: Columns = FIRST_COLUMNS
    declared: int | None = None
    """A number of points."""
    line_of_declared: int = 0


def _take_head(lines: Lines) -> _Head:
    """Takes what comes before the first point: comments, a line of names, a number of points."""
    head = _Head()
    named: Columns | None = None
    commented: tuple[Columns, int] | None = None
    before = lines.copy()
    for line_number, line in lines:
        words = comment(line)
        if words is not None:
            commented = _names(text_of(words)) or commented
        elif line:
            text = text_of(line)
            names, count = _names(text), whole(text)
            if names is not None and named is None:
                named = names[0]
            elif count is not None and head.declared is None and any(is_content(other) for _, other in lines.copy()):
                head.declared, head.line_of_declared = count, line_number
            else:
                # The words of a comment are names where there are as many as columns.
                if named is None and commented is not None and commented[1] == len(_cells(text)):
                    named = commented[0]
                lines.go_back_to(before)
                break
        before = lines.copy()
    head.columns = FIRST_COLUMNS if named is None else named
    return head


def _names(text: str) -> tuple[Columns, int] | None:
    """The columns that a line names and how many names it has, where x, y and z are among them."""
    names = [cell.strip("\"'") for cell in _cells(text.strip())]
    try:
        return axes_of(names), len(names)
    except AxisMissing:
        return None


def _cells(text: str) -> list[str]:
    """The cells of a line. Semicolons and commas divide even after nothing: an empty cell is an error, and no shifted column."""
    separator = next((of for of in ";," if of in text), None)
    if separator is None:
        return words_of(text)
    return [cell.strip() for cell in text.rstrip().removesuffix(separator).split(separator)]


def _point(text: str, columns: Columns) -> list[float]:
    cells, last = _cells(text), max(columns)
    # As many as there are: a wrong one is told before a missing one.
    point = [_coordinate(cells[at], text) for at in sorted(columns) if at < len(cells)]
    if len(cells) <= last:
        needed = "x y z are needed" if columns == FIRST_COLUMNS else f"column {last + 1} is needed"
        raise Problem(f"{len(cells)} columns, {needed}")
    by_column = dict(zip(sorted(columns), point, strict=True))
    return [by_column[at] for at in columns]


def _coordinate(cell: str, line: str) -> float:
    """A coordinate of a line. Where semicolons divide, a comma may be the decimal point."""
    before, comma, behind = cell.partition(",")
    if comma and ";" in line and "." not in cell and "," not in behind:
        try:
            return number(f"{before}.{behind}")
        except Problem:
            raise Problem(not_a_number(cell)) from None
    return number(cell)
