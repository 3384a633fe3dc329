"""One robot: clouds of `cloud` go into `map` on `server`, and map -> odom, the grid and the octree come back."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    "server": ("localhost:7333", "address of the server's HTTP"),
    "map": ("map", "name of the map on the server"),
    "robot": ("", "name of the robot; empty: the host's name"),
    "cloud": ("points", "topic of the clouds"),
    "use_sim_time": ("false", "whether the clock is /clock: must be true in a simulation, and everywhere the same"),
    "params_file": (PathJoinSubstitution([FindPackageShare("mrol_ros"), "config", "mrol.yaml"]), "other parameters"),
}


def generate_launch_description():
    """The node."""
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    declared = [DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()]
    # As text, whatever it looks like: a map may be named 7.
    own = {name: ParameterValue(given[name], value_type=str) for name in ("server", "map", "robot")}
    own["use_sim_time"] = ParameterValue(given["use_sim_time"], value_type=bool)
    node = Node(
        package="mrol_ros",
        executable="node",
        name="mrol",
        parameters=[given["params_file"], {**own, "publish_tf": True}],
        remappings=[("cloud_in", given["cloud"])],
        output="screen",
    )
    return LaunchDescription([*declared, node])
