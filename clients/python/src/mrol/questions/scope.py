"""The options that questions have in common: each is declared once, with its type, default, check and description.

A method takes them as `**scope: Unpack[QuestionScope]`, checks what it was given by `QUESTION.checked`, and is decorated by
`QUESTION.documented`, so that `help` and `inspect.signature` tell of each. A new option of all questions is a field of
`QuestionScope`, and one more name in `Scope` of the extension (`clients/python-replica/src/scope.rs`).
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypedDict, get_type_hints

from .._arguments import flag_of, level_of, word_of
from .._arrays import whole_of
from .._option_docs import Method, append_options

Scope = Mapping[str, Any]
"""Options that were given, and checked."""


@dataclass(frozen=True)
class Option:
    """An option: what stands for it where it is not given, what a value has to be, and what it means."""

    default: object
    checked: Callable[[object, str], object]
    description: str


class LookupScope(TypedDict, total=False):
    """The options of `query`."""

    level: Annotated[int, Option(0, level_of, "The level of the voxels; 0 is the finest.")]
    min_revision: Annotated[
        "int | None",
        Option(None, whole_of, "The least revision to ask: a server waits for it, a replica that has not got it refuses."),
    ]
    map_uuid: Annotated[
        "str | None",
        Option(None, word_of, "The uuid of the map that is meant: another one of the same name is refused (`map_replaced`)."),
    ]


class QuestionScope(LookupScope, total=False):
    """The options of all other questions of planners."""

    ignore_keep_outs: Annotated[bool, Option(False, flag_of, "Whether keep-outs do not count; otherwise they are obstacles.")]


class Options:
    """The options that a class declares."""

    def __init__(self, declared: type) -> None:
        hints = get_type_hints(declared, include_extras=True)
        self._options: dict[str, Option] = {name: hint.__metadata__[0] for name, hint in hints.items()}
        self._parameters = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=self._options[name].default, annotation=hint.__origin__)
            for name, hint in hints.items()
        ]
        # The other options of each method.
        self._own: dict[str, list[str]] = {}

    def checked(self, given: Mapping[str, object], method: str) -> Scope:
        """The options that were given to a method beside its own, checked.

        Raises `ArgumentError`, and `TypeError` for what is no option.
        """
        if not given:
            return given
        scope = {}
        for name, value in given.items():
            option = self._options.get(name)
            if option is None:
                known = ", ".join([*self._own[method], *self._options])
                raise TypeError(f"{method}() got an unexpected keyword argument {name!r}; its options are {known}")
            # None is to give nothing, where that is the default.
            if value is not None or option.default is not None:
                scope[name] = option.checked(value, name)
        return scope

    def documented(self, method: Method) -> Method:
        """Tells `help`, `inspect` and `get_type_hints` of a method that `**scope` is these options."""
        signature = inspect.signature(method)
        own = [of for of in signature.parameters.values() if of.kind is not inspect.Parameter.VAR_KEYWORD]
        method.__signature__ = signature.replace(parameters=[*own, *self._parameters])  # type: ignore[attr-defined]
        of_scope = {of.name: of.annotation for of in self._parameters}
        method.__annotations__ = {name: hint for name, hint in method.__annotations__.items() if name != "scope"} | of_scope
        descriptions = {name: option.description for name, option in self._options.items()}
        append_options(method, "Options of all such questions:", descriptions)
        self._own[method.__name__] = [of.name for of in own if of.kind is inspect.Parameter.KEYWORD_ONLY]
        return method


LOOKUP = Options(LookupScope)
QUESTION = Options(QuestionScope)
