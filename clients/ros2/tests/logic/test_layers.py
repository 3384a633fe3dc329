"""Which module knows what, and what the launch files set."""

import ast
import re
import sys
from pathlib import Path

import pytest

from mrol_ros.options import Options

PACKAGE = Path(__file__).resolve().parents[2]
KNOW_ROS = {"messages.py", "node.py"}


def imported(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.split(".")[0]
        elif isinstance(node, ast.ImportFrom):
            yield f".{node.module}"


@pytest.mark.parametrize("file", sorted((PACKAGE / "mrol_ros").glob("*.py")), ids=lambda file: file.name)
def test_two_modules_alone_know_ros(file):
    names = set(imported(ast.parse(file.read_text())))
    if file.name not in KNOW_ROS:
        assert {name for name in names if not name.startswith(".")} <= set(sys.stdlib_module_names) | {"numpy", "mrol"}
        assert not names & {".node", ".messages"}


def test_files_of_parameters_name_parameters_that_there_are():
    text = (PACKAGE / "config/mrol.yaml").read_text()
    named = re.findall(r"^    (\w+): (.+)$", text, re.MULTILINE)
    assert len(named) > 5
    for name, value in named:
        default = getattr(Options, name)
        written = {"true": True, "false": False}.get(value, value)
        assert str(default) == str(written), name


@pytest.mark.parametrize("file", sorted((PACKAGE / "launch").glob("*.py")), ids=lambda file: file.name)
def test_launch_files_name_parameters_that_there_are(file):
    text = file.read_text()
    compile(text, str(file), "exec")
    known = {*Options.__dataclass_fields__, "use_sim_time"}
    own = re.search(r"own = \{name: ParameterValue\(.*? for name in \(([^)]*)\)\}", text)
    named = re.findall(r'"(\w+)"', own.group(1))
    assert named[:2] == ["server", "map"]
    # The others would need another type.
    assert all(isinstance(getattr(Options, name), str) for name in named)
    for of in re.findall(r"\*\*own, ([^*}]*)", text):
        assert set(re.findall(r'"(\w+)":', of)) <= known
    if "FOR_NAV2" in text:
        of_nav2 = re.search(r"FOR_NAV2 = \{(.*?)\n\}", text, re.DOTALL)
        assert set(re.findall(r'"(\w+)":', of_nav2.group(1))) <= known
    assert '("cloud_in", given["cloud"])' in text
