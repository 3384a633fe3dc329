"""The options that all questions have in common, and the one class of questions."""

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_type_hints

import pytest

import mrol
from mrol.questions.scope import LookupScope

OF_QUESTIONS = tuple(get_type_hints(mrol.QuestionScope))
OF_LOOKUPS = tuple(get_type_hints(LookupScope))
QUESTIONS = {name: method for name, method in inspect.getmembers(mrol.Questions, inspect.isfunction) if not name.startswith("_")}
POINT = [[0.0, 0.0, 0.0]]

ASKED: dict[str, Callable[..., Any]] = {
    "query": lambda m, **scope: m.query(POINT, **scope),
    "classify": lambda m, **scope: m.classify(POINT, **scope),
    "check_poses": lambda m, **scope: m.check_poses([[0, 0, 0, 1]], POINT, **scope),
    "check_spheres": lambda m, **scope: m.check_spheres([[0, 0, 0, 1]], **scope),
    "check_motions": lambda m, **scope: m.check_motions([[0, 0, 0, 1]], POINT * 2, **scope),
    "cast_rays": lambda m, **scope: m.cast_rays(POINT, ends=[[1, 0, 0]], **scope),
    "nearest": lambda m, **scope: m.nearest(POINT, 1.0, **scope),
    "frontiers": lambda m, **scope: m.frontiers([[0, 0, 0], [1, 1, 1]], **scope),
    "grid": lambda m, **scope: m.grid([[0, 0], [1, 1]], **scope),
    "whole_grid": lambda m, **scope: m.whole_grid([[0, 0], [1, 1]], **scope),
}


def test_every_question_is_asked_here() -> None:
    assert set(QUESTIONS) | {"whole_grid"} == set(ASKED)
    # What a map of a server is asked is that very method.
    assert all(getattr(mrol.Map, name) is method for name, method in QUESTIONS.items())


@pytest.mark.parametrize("question", ASKED)
def test_help_tells_of_each_option(question: str) -> None:
    method = getattr(mrol.Map, question)
    options = OF_LOOKUPS if question == "query" else OF_QUESTIONS
    parameters = inspect.signature(method).parameters
    assert tuple(parameters)[-len(options) :] == options
    for name in options:
        assert parameters[name].kind is inspect.Parameter.KEYWORD_ONLY
        assert f"`{name}`: " in (inspect.getdoc(method) or "")
    assert set(options) < set(get_type_hints(method))
    assert parameters["level"].default == 0
    assert all(kind.kind is not inspect.Parameter.VAR_KEYWORD for kind in parameters.values())


@pytest.mark.parametrize("question", ASKED)
def test_a_wrong_option_is_named(hall: mrol.Map, question: str) -> None:
    ask = ASKED[question]
    with pytest.raises(TypeError) as unknown:
        ask(hall, levl=1)
    parameters = inspect.signature(getattr(mrol.Map, question)).parameters.values()
    options = ", ".join(of.name for of in parameters if of.kind is of.KEYWORD_ONLY)
    assert str(unknown.value) == f"{question}() got an unexpected keyword argument 'levl'; its options are {options}"
    for name, value in {"level": -1, "min_revision": 0.5, "map_uuid": ""}.items():
        with pytest.raises(mrol.ArgumentError) as refused:
            ask(hall, **{name: value})
        assert refused.value.argument == name
    if question == "query":
        with pytest.raises(TypeError, match="'ignore_keep_outs'"):
            ask(hall, ignore_keep_outs=True)


@pytest.mark.parametrize("question", ASKED)
def test_options_reach_the_server(hall: mrol.Map, question: str) -> None:
    ask, here = ASKED[question], hall.describe().version
    assert ask(hall, level=1, min_revision=here.revision, map_uuid=here.map_uuid).revision == here.revision
    assert ask(hall, min_revision=None, map_uuid=None).revision == here.revision
    with pytest.raises(mrol.InvalidArgument, match="level_out_of_range"):
        ask(hall, level=20)
    with pytest.raises(mrol.FailedPrecondition, match="map_replaced"):
        ask(hall, map_uuid="00000000-0000-0000-0000-000000000000")


def test_each_option_is_declared_once() -> None:
    package = Path(mrol.__file__).parent
    texts = [path.read_text(encoding="utf-8") for path in package.rglob("*.py")]
    for name in ("ignore_keep_outs", "min_revision"):
        assert sum(len(re.findall(rf"\b{name}:", text)) for text in texts) == 1, name
