"""What launch files describe, without `launch` and `launch_ros`, which the index of Python packages has not.

Stubs stand in their place: as far as the files of this package use them, they mean what the documentation of ROS 2 says. So a node
of a file is a name, a namespace, parameters in the order in which later ones count, and remappings.
"""

import importlib.util
import json
import sys
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

PACKAGE = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class LaunchConfiguration:
    """The value of an argument."""

    name: str

    def value(self, arguments):
        return arguments[self.name]


@dataclass(frozen=True)
class PathJoinSubstitution:
    """A path of parts."""

    parts: tuple

    def __init__(self, parts):
        object.__setattr__(self, "parts", tuple(parts))

    def value(self, arguments):
        return str(Path(*(resolved(part, arguments) for part in self.parts)))


@dataclass(frozen=True)
class FindPackageShare:
    """The folder that a package is installed to; here that of its sources, which has the same folders."""

    package: str

    def value(self, _):
        assert self.package == "mrol_ros"
        return str(PACKAGE)


@dataclass(frozen=True)
class ParameterValue:
    """A parameter whose type does not follow from how the value looks."""

    given: object
    value_type: type

    def value(self, arguments):
        text = resolved(self.given, arguments)
        return {"true": True, "false": False}[text.lower()] if self.value_type is bool else self.value_type(text)


@dataclass(frozen=True)
class DeclareLaunchArgument:
    """An argument of the file."""

    name: str
    default_value: object
    description: str


@dataclass(frozen=True)
class Node:
    """A process."""

    package: str
    executable: str
    name: str
    parameters: list
    remappings: list
    output: str
    namespace: str = ""


@dataclass(frozen=True)
class LaunchDescription:
    """All of a file."""

    entities: list


@dataclass(frozen=True)
class LaunchedNode:
    """A node as it would be started."""

    name: str
    namespace: str
    parameters: dict
    """By name; of those that are given twice the last one."""
    remappings: dict = field(default_factory=dict)

    @property
    def arguments(self):
        """Those behind `--ros-args`."""
        found = ["-r", f"__node:={self.name}", "-r", f"__ns:=/{self.namespace}"]
        for name, value in self.parameters.items():
            found += ["-p", f"{name}:={json.dumps(value)}"]
        for before, after in self.remappings.items():
            found += ["-r", f"{before}:={after}"]
        return found


STUBS = {
    "launch": {"LaunchDescription": LaunchDescription},
    "launch.actions": {"DeclareLaunchArgument": DeclareLaunchArgument},
    "launch.substitutions": {"LaunchConfiguration": LaunchConfiguration, "PathJoinSubstitution": PathJoinSubstitution},
    "launch_ros": {},
    "launch_ros.actions": {"Node": Node},
    "launch_ros.parameter_descriptions": {"ParameterValue": ParameterValue},
    "launch_ros.substitutions": {"FindPackageShare": FindPackageShare},
}


@contextmanager
def stubs():
    """The stubs as the modules that they stand for."""
    before = {name: sys.modules.get(name) for name in STUBS}
    for name, contents in STUBS.items():
        module = ModuleType(name)
        vars(module).update(contents)
        sys.modules[name] = module
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module


def resolved(value, arguments):
    """A value in which substitutions are made."""
    return value.value(arguments) if hasattr(value, "value") else value


def parameters_of_file(path):
    """The parameters of a file like `config/mrol.yaml`: a name and a value a line, of all nodes."""
    lines = [line for line in Path(path).read_text().splitlines() if line.strip() and not line.lstrip().startswith("#")]
    assert lines[:2] == ["/**:", "  ros__parameters:"], lines[:2]
    found = {}
    for line in lines[2:]:
        name, _, text = line.strip().partition(": ")
        try:
            found[name] = json.loads(text)
        except ValueError:
            found[name] = text
    return found


def launched(file, **arguments):
    """The nodes that `ros2 launch mrol_ros FILE NAME:=VALUE ...` starts."""
    with stubs():
        spec = importlib.util.spec_from_file_location("launched", PACKAGE / "launch" / file)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        entities = module.generate_launch_description().entities
    declared = {of.name: of for of in entities if isinstance(of, DeclareLaunchArgument)}
    assert set(arguments) <= set(declared), f"{file} takes {sorted(declared)}"
    given = {name: resolved(of.default_value, {}) for name, of in declared.items()} | arguments
    found = []
    for node in entities:
        if isinstance(node, Node):
            assert (node.package, node.executable) == ("mrol_ros", "node")
            parameters = {}
            for part in node.parameters:
                of_part = part if isinstance(part, dict) else parameters_of_file(resolved(part, given))
                parameters |= {name: resolved(value, given) for name, value in of_part.items()}
            remappings = {before: resolved(after, given) for before, after in node.remappings}
            found.append(LaunchedNode(node.name, node.namespace, parameters, remappings))
    return found
