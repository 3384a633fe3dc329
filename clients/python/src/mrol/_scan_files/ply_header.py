"""Headers of `.ply` files, as programs write them."""

from dataclasses import dataclass, field

from .axes import AxisMissing, AxisTwice, Columns, axes_of
from .counts import HEADER_BYTES_MAX
from .lines import Lines, text_of, words_of
from .numbers import whole
from .problem import Problem, quoted

ENCODINGS = ("ascii", "binary_little_endian", "binary_big_endian")

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    **dict.fromkeys(("half", "float16"), "V2"),
    **dict.fromkeys(("int64", "uint64"), "V8"),
}
"""Types of numpy by their names; V are bytes that are only skipped."""


@dataclass(frozen=True)
class Property:
    """A property, under any name: programs give their own ones those of units and dimensions."""

    name: str
    line: int
    type_name: str
    length_type_name: str | None = None
    """The type of the length, of a list."""

    @property
    def is_list(self) -> bool:
        """Whether it is a list."""
        return self.length_type_name is not None

    def kind(self) -> str:
        """The type of its values, as numpy names it without the order of bytes. Text may have values of any type."""
        return self._known(self.type_name)

    def length_kind(self) -> str:
        """The type of a list's length."""
        assert self.length_type_name is not None
        kind = self._known(self.length_type_name)
        if kind[0] not in "iu":
            raise self.problem(f"it is a list with a length of {quoted(self.length_type_name)}")
        return kind

    def problem(self, problem: str) -> Problem:
        """A problem of this property, with its line."""
        return Problem(f"property {quoted(self.name)}: {problem}", self.line)

    def _known(self, name: str) -> str:
        if name not in _TYPES:
            raise self.problem(f"type {quoted(name)} is not known, so its bytes are not")
        return _TYPES[name]


@dataclass
class Element:
    """An element, and its properties in order."""

    name: str
    count: int
    line: int
    properties: list[Property] = field(default_factory=list)


@dataclass(frozen=True)
class PlyHeader:
    """What a header declares."""

    encoding: str
    before: list[Element]
    """The elements whose entries lie before those of `vertex`."""
    vertex: Element
    axes: Columns
    """Where x, y and z are among the properties of `vertex`."""


def take_header(lines: Lines) -> PlyHeader:
    """Takes the header from the lines of a file."""
    start = next(iter(lines), None)
    if start is None:
        raise Problem("not a ply header: the file is empty")
    if start[1] != b"ply":
        raise Problem(f"not a ply header: {quoted(text_of(start[1]))}", start[0])
    encoding: str | None = None
    elements: list[Element] = []
    for number, line in lines:
        if lines.at > HEADER_BYTES_MAX:
            break
        text = text_of(line)
        word, words = _divided(text)
        if word in ("", "comment", "obj_info"):
            continue
        if word == "end_header":
            if encoding is None:
                raise Problem("not a ply header: it has no format line")
            return _header(encoding, elements)
        if word == "format":
            encoding = _encoding(words, number)
        elif word == "element":
            elements.append(_element(words, number))
        elif word == "property":
            made = _property(words, number)
            if not elements:
                raise Problem("a property before any element", number)
            elements[-1].properties.append(made)
        else:
            problem = "is none of format, element, property, comment, obj_info, end_header"
            raise Problem(f"{quoted(text)} {problem}", number)
    raise Problem("not a ply header: it has no line end_header")


def _header(encoding: str, elements: list[Element]) -> PlyHeader:
    names = [element.name for element in elements]
    for place, element in enumerate(elements):
        # It would misplace all that follows.
        if element.name in names[:place]:
            raise Problem(f"element {quoted(element.name)} is declared twice", element.line)
    if "vertex" not in names:
        raise Problem("no element vertex in the header")
    place = names.index("vertex")
    vertex = elements[place]
    try:
        axes = axes_of([of.name for of in vertex.properties])
    except AxisTwice as twice:
        raise Problem(f"element vertex has property {twice.axis} twice") from None
    except AxisMissing as missing:
        raise Problem(f"element vertex has no property {missing.axis}") from None
    for axis in axes:
        of = vertex.properties[axis]
        if of.is_list or _TYPES.get(of.type_name) not in ("f4", "f8"):
            raise of.problem(f"it is {quoted(of.type_name)}{' in a list' if of.is_list else ''}, float or double is needed")
    return PlyHeader(encoding, elements[:place], vertex, axes)


def _divided(text: str) -> tuple[str, str]:
    """The first word, and what follows the space behind it."""
    ends = [place for place in (text.find(" "), text.find("\t")) if place >= 0]
    return (text[: min(ends)], text[min(ends) + 1 :]) if ends else (text, "")


def _encoding(words: str, line: int) -> str:
    name = next(iter(words_of(words)), "")
    if name not in ENCODINGS:
        raise Problem(f"format {quoted(name)} is none of {', '.join(ENCODINGS)}", line)
    return name


def _element(words: str, line: int) -> Element:
    """The element of a line `element NAME COUNT`."""
    text = words.strip()
    end = max(text.rfind(" "), text.rfind("\t"))
    name, count_text = (text[:end], text[end + 1 :]) if end >= 0 else (text, "")
    count = whole(count_text)
    if count is None:
        told = f'"element {name} {count_text}"'
        raise Problem(f"{told} has no number from 0 on: {quoted(count_text)} is not one", line)
    return Element(name.strip(), count, line)


def _property(words: str, line: int) -> Property:
    """The property of a line `property TYPE NAME` or `property list TYPE TYPE NAME`."""

    def taken(rest: str) -> tuple[str, str]:
        word, after = _divided(rest.lstrip())
        if not after:
            raise Problem(f'"property {words}" has no type and name', line)
        return word, after

    type_name, rest = taken(words)
    length: str | None = None
    if type_name == "list":
        length, rest = taken(rest)
        type_name, rest = taken(rest)
    if not rest.strip():
        raise Problem(f'"property {words}" has no type and name', line)
    return Property(rest.strip(), line, type_name, length)
