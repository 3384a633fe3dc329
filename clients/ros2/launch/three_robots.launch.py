"""Three robots in namespaces of their own, into one map.

Each has topics tf and tf_static of its own, as Nav2 starts several robots. They are named by their namespaces. Give each an
`initial_pose`, where it begins in the map, or publish its `initialpose` later: the server does not know where a robot is
that it has never seen.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

BEGINNINGS = {
    "r1": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    "r2": [0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    "r3": [0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 1.0],
}
"""Where each robot begins in the map: x y z qx qy qz qw of its base. Replace them by yours."""

ARGUMENTS = {
    "server": ("localhost:7333", "address of the server's HTTP"),
    "map": ("map", "name of the map on the server"),
    "cloud": ("points", "topic of the clouds, in the namespace of each robot"),
    "use_sim_time": ("false", "whether the clock is /clock: must be true in a simulation, and everywhere the same"),
    "params_file": (PathJoinSubstitution([FindPackageShare("mrol_ros"), "config", "mrol.yaml"]), "other parameters"),
}


def generate_launch_description():
    """A node for each robot."""
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    declared = [DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()]
    # As text, whatever it looks like: a map may be named 7.
    own = {name: ParameterValue(given[name], value_type=str) for name in ("server", "map")}
    own["use_sim_time"] = ParameterValue(given["use_sim_time"], value_type=bool)
    nodes = [
        Node(
            package="mrol_ros",
            executable="node",
            name="mrol",
            namespace=robot,
            parameters=[given["params_file"], {**own, "publish_tf": True, "initial_pose": beginning}],
            remappings=[("cloud_in", given["cloud"]), ("/tf", "tf"), ("/tf_static", "tf_static")],
            output="screen",
        )
        for robot, beginning in BEGINNINGS.items()
    ]
    return LaunchDescription([*declared, *nodes])
