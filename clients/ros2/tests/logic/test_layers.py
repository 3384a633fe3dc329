"""Which module knows what, and what the file of parameters sets."""

import ast
import re
import sys
from pathlib import Path

import pytest

from mrol_ros.options import Options

PACKAGE = Path(__file__).resolve().parents[2]
KNOW_ROS = {"callbacks.py", "messages.py", "node.py"}


def imported(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.split(".")[0]
        elif isinstance(node, ast.ImportFrom):
            yield f".{node.module}"


@pytest.mark.parametrize("file", sorted((PACKAGE / "mrol_ros").glob("*.py")), ids=lambda file: file.name)
def test_three_modules_alone_know_ros(file):
    names = set(imported(ast.parse(file.read_text())))
    if file.name not in KNOW_ROS:
        assert {name for name in names if not name.startswith(".")} <= set(sys.stdlib_module_names) | {"numpy", "mrol"}
        assert not names & {".callbacks", ".node", ".messages"}


def test_files_of_parameters_name_parameters_that_there_are():
    text = (PACKAGE / "config/mrol.yaml").read_text()
    named = re.findall(r"^    (\w+): (.+)$", text, re.MULTILINE)
    assert len(named) > 5
    for name, value in named:
        default = getattr(Options, name)
        written = {"true": True, "false": False}.get(value, value)
        assert str(default) == str(written), name
