"""What the launch files start."""

import re
from pathlib import Path

import pytest

from mrol_ros.options import Options

from ..launching import PACKAGE, launched

FILES = sorted(file.name for file in (PACKAGE / "launch").glob("*.py"))


def options_of(node):
    """The options of a node, which refuse what is no parameter, of another type, or out of range."""
    own = dict(node.parameters)
    assert isinstance(own.pop("use_sim_time"), bool)
    assert set(own) <= set(Options.__dataclass_fields__)
    return Options.of(own)


def topics_of_node():
    """The topics that the node takes and publishes, as its source names them."""
    source = (PACKAGE / "mrol_ros/node.py").read_text()
    return set(re.findall(r'create_(?:publisher|subscription)\(\w+, "([\w/]+)"', source))


@pytest.mark.parametrize("file", FILES)
def test_every_node_takes_the_parameters_and_remappings_of_its_launch_file(file):
    for node in launched(file):
        assert options_of(node).publish_tf
        assert set(node.remappings) <= topics_of_node()
        assert node.remappings["cloud_in"] == "points"


@pytest.mark.parametrize("file", FILES)
def test_arguments_reach_every_node_as_what_they_are(file):
    given = {"server": "10.0.0.1:7333", "map": "7", "cloud": "/lidar/points", "use_sim_time": "true"}
    nodes = launched(file, **given)
    assert len(nodes) == (3 if "three" in file else 1)
    for node in nodes:
        options = options_of(node)
        # A map that is named by a number stays a name.
        assert (options.server, options.map) == ("10.0.0.1:7333", "7")
        assert node.parameters["use_sim_time"] is True
        assert node.remappings["cloud_in"] == "/lidar/points"


def test_robots_are_named_by_their_namespaces_and_begin_apart():
    nodes = launched("three_robots.launch.py")
    assert [options_of(node).robot_name(f"/{node.namespace}") for node in nodes] == ["r1", "r2", "r3"]
    assert len({tuple(options_of(node).initial_pose) for node in nodes}) == 3
    # Each has a tree of frames of its own.
    assert all((node.remappings["/tf"], node.remappings["/tf_static"]) == ("tf", "tf_static") for node in nodes)
    assert options_of(launched("one_robot.launch.py", robot="cart")[0]).robot == "cart"


def test_another_file_of_parameters_takes_the_place_of_the_first(tmp_path):
    file = tmp_path / "own.yaml"
    file.write_text("/**:\n  ros__parameters:\n    resolution: 0.05\n    map: other\n")
    options = options_of(launched("one_robot.launch.py", params_file=str(file), map="hall")[0])
    # What is said on the command line counts first.
    assert (options.resolution, options.map, options.grid_period_s) == (0.05, "hall", 2.0)


def test_the_layer_of_nav2_takes_the_topic_and_the_frames_that_the_node_publishes():
    text = (PACKAGE / "config/nav2_static_layer.yaml").read_text()
    node = launched("nav2_static_layer.launch.py")[0]
    options = options_of(node)
    values = dict(re.findall(r"^ *(\w+): (\S+)$", text, re.MULTILINE))
    assert node.namespace == ""
    assert values["map_topic"] == "/map"
    assert values["map_subscribe_transient_local"] == "true"
    assert (values["global_frame"], values["robot_base_frame"]) == (options.map_frame, options.base)
    assert '"map", LATCHED' in Path(PACKAGE / "mrol_ros/node.py").read_text()
