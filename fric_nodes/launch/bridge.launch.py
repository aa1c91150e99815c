"""A real drive under control: hardware_bridge, compensator, pid, recorder.

    ros2 launch fric_nodes bridge.launch.py port:=/dev/ttyACM0

An example, to be copied and changed: give the machine's own limits in a parameter file. The bridge gives no force before
the service ``/hardware_bridge/enable`` is called. Nothing here moves the axis: start ``excitation`` when it is enabled.
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
    driver = ParameterValue(LaunchConfiguration("driver"), value_type=str)
    port = ParameterValue(LaunchConfiguration("port"), value_type=str)
    model_file = ParameterValue(LaunchConfiguration("model_file"), value_type=str)
    bag = ParameterValue(LaunchConfiguration("bag"), value_type=str)
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "limits",
                default_value=str(config / "hardware_bridge.yaml"),
                description="parameter file of the bridge, with the limits of the machine",
            ),
            DeclareLaunchArgument("driver", default_value="serial", description="protocol: serial, cia402 or ros2_control"),
            DeclareLaunchArgument("port", default_value="/dev/ttyACM0", description="of the serial drive"),
            DeclareLaunchArgument("model_file", default_value="", description="fric-model/1 file of the compensator"),
            DeclareLaunchArgument("bag", default_value="bags/bridge", description="folder to record into; must not exist"),
            Node(
                package="fric_nodes",
                executable="hardware_bridge",
                parameters=[LaunchConfiguration("limits"), {"driver": driver, "serial.port": port}],
            ),
            Node(
                package="fric_nodes",
                executable="compensator",
                parameters=[str(config / "compensator.yaml"), {"model_file": model_file}],
            ),
            Node(
                package="fric_nodes",
                executable="pid",
                parameters=[str(config / "pid.yaml")],
            ),
            Node(
                package="fric_nodes",
                executable="recorder",
                parameters=[{"bag": bag}],
            ),
        ]
    )
