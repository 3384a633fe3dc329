"""One robot whose grid is the static layer of Nav2: the node in place of Nav2's map_server and of amcl.

Nav2 itself is started as you do it, without these two, with `config/nav2_static_layer.yaml` merged into its parameters.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    "server": ("localhost:7333", "address of the server's HTTP"),
    "map": ("map", "name of the map on the server"),
    "cloud": ("points", "topic of the clouds"),
    "use_sim_time": ("false", "whether the clock is /clock: must be true in a simulation, and everywhere the same"),
}

FOR_NAV2 = {
    "publish_tf": True,
    # What is lower than the robot's clearance is no obstacle, nor what it fits under.
    "occupancy_min_z": 0.1,
    "occupancy_max_z": 1.5,
    # Controllers ask for transforms of now, while clouds are a sweep and a request old.
    "transform_tolerance": 0.5,
}


def generate_launch_description():
    """The node."""
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    declared = [DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()]
    # As text, whatever it looks like: a map may be named 7.
    own = {name: ParameterValue(given[name], value_type=str) for name in ("server", "map")}
    own["use_sim_time"] = ParameterValue(given["use_sim_time"], value_type=bool)
    node = Node(
        package="mrol_ros",
        executable="node",
        name="mrol",
        parameters=[{**own, **FOR_NAV2}],
        remappings=[("cloud_in", given["cloud"])],
        output="screen",
    )
    return LaunchDescription([*declared, node])
