"""One simulated axis with compensation, recorded: plant, compensator, pid, recorder, excitation.

    ros2 launch fric_nodes one_axis.launch.py model_file:=found/model.yaml bag:=bags/my_run

An example, to be copied and changed. The motion waits for the recorder, whatever starts first.
"""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description() -> LaunchDescription:
    """What ``ros2 launch`` starts."""
    config = Path(get_package_share_directory("fric_nodes")) / "config"
    namespace = LaunchConfiguration("namespace")
    # A path that looks like a number stays a text.
    model_file = ParameterValue(LaunchConfiguration("model_file"), value_type=str)
    bag = ParameterValue(LaunchConfiguration("bag"), value_type=str)
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="of all nodes and of their topics"),
            DeclareLaunchArgument("model_file", default_value="", description="fric-model/1 file of the compensator"),
            DeclareLaunchArgument("bag", default_value="bags/one_axis", description="folder to record into; must not exist"),
            Node(
                package="fric_nodes",
                executable="plant",
                namespace=namespace,
                parameters=[str(config / "plant.yaml")],
            ),
            Node(
                package="fric_nodes",
                executable="compensator",
                namespace=namespace,
                parameters=[str(config / "compensator.yaml"), {"model_file": model_file}],
            ),
            Node(
                package="fric_nodes",
                executable="pid",
                namespace=namespace,
                parameters=[str(config / "pid.yaml")],
            ),
            Node(
                package="fric_nodes",
                executable="recorder",
                namespace=namespace,
                parameters=[{"bag": bag}],
            ),
            Node(
                package="fric_nodes",
                executable="excitation",
                namespace=namespace,
                parameters=[str(config / "excitation.yaml"), {"wait_for_nodes": ["recorder"]}],
            ),
        ]
    )
