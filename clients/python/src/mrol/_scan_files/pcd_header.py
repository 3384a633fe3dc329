"""Headers of `.pcd` files, as programs write them."""

from dataclasses import dataclass

from .axes import AxisMissing, AxisTwice, Columns, axes_of
from .counts import HEADER_BYTES_MAX
from .lines import Lines, text_of, words_of
from .numbers import whole
from .problem import Problem, quoted

KINDS = ("ascii", "binary", "binary_compressed")

Entries = dict[str, tuple[int, list[str]]]
"""The lines of a header by their names: a number, and the values."""


@dataclass(frozen=True)
class PcdHeader:
    """What a header declares."""

    sizes: list[int]
    """Bytes of a value of each field."""
    counts: list[int]
    """How many values each field has; none where 0, a padding that takes no bytes."""
    axes: Columns
    """Which fields are x, y and z."""
    points: int
    kind: str

    @property
    def record_bytes(self) -> int:
        """Bytes of all fields of a point."""
        return sum(size * count for size, count in zip(self.sizes, self.counts, strict=True))

    def offset(self, field: int) -> int:
        """Where a field begins in a point."""
        return sum(size * count for size, count in zip(self.sizes[:field], self.counts[:field], strict=True))


def take_header(lines: Lines) -> PcdHeader:
    """Takes the header from the lines of a file."""
    entries: Entries = {}
    for number, line in lines:
        if lines.at > HEADER_BYTES_MAX:
            break
        words = words_of(text_of(line).split("#", 1)[0])
        if not words:
            continue
        name = words[0].upper()
        entries["FIELDS" if name == "COLUMNS" else name] = number, words[1:]
        if name == "DATA":
            return _header(entries)
    raise Problem("not a pcd header: it has no DATA line")


def _header(entries: Entries) -> PcdHeader:
    line, names = _needed(entries, "FIELDS")
    sizes, types = _whole_numbers(entries, "SIZE", len(names)), _of_fields(entries, "TYPE", len(names))
    if sizes is None or types is None:
        raise _missing("SIZE" if sizes is None else "TYPE")
    counts = _whole_numbers(entries, "COUNT", len(names))
    if counts is None:
        counts = [1] * len(names)
    try:
        axes = axes_of(names)
    except AxisTwice as twice:
        raise Problem(f"field {twice.axis} is declared twice", line) from None
    except AxisMissing as missing:
        raise Problem(f"no field {missing.axis} in the header", line) from None
    for place in axes:
        size, count, of_type = sizes[place], counts[place], types[1][place]
        if of_type.upper() != "F" or size not in (4, 8) or count != 1:
            raise Problem(
                f"field {names[place]} is {count} of type {of_type} and size {size}, one of type F and size 4 or 8 is needed"
            )
    return PcdHeader(sizes, counts, axes, _points(entries), _kind(entries))


def _missing(name: str) -> Problem:
    return Problem(f"not a pcd header: it has no {name} line")


def _needed(entries: Entries, name: str) -> tuple[int, list[str]]:
    if name not in entries:
        raise _missing(name)
    return entries[name]


def _of_fields(entries: Entries, name: str, fields: int) -> tuple[int, list[str]] | None:
    """An entry with a value for each field, where the header has it."""
    found = entries.get(name)
    if found is not None and len(found[1]) != fields:
        raise Problem(f"{name} has {len(found[1])} values, FIELDS {fields}", found[0])
    return found


def _whole_numbers(entries: Entries, name: str, fields: int) -> list[int] | None:
    found = _of_fields(entries, name, fields)
    return None if found is None else [_whole(name, value, found[0]) for value in found[1]]


def _whole(name: str, text: str, line: int) -> int:
    value = whole(text)
    if value is None:
        raise Problem(f"{name} {quoted(text)} is not a number from 0 on", line)
    return value


def _points(entries: Entries) -> int:
    """How many points follow: POINTS, or else WIDTH times HEIGHT."""
    found = {
        name: _whole(name, next(iter(values), ""), line)
        for name, (line, values) in entries.items()
        if name in ("POINTS", "WIDTH", "HEIGHT")
    }
    if "POINTS" in found:
        return found["POINTS"]
    if "WIDTH" in found:
        return found["WIDTH"] * found.get("HEIGHT", 1)
    raise Problem("not a pcd header: it has neither POINTS nor WIDTH")


def _kind(entries: Entries) -> str:
    line, values = _needed(entries, "DATA")
    name = next(iter(values), "")
    if name.lower() not in KINDS:
        raise Problem(f"DATA {quoted(name)} is none of {', '.join(KINDS)}", line)
    return name.lower()
