"""Two simulated axes in one graph, under the namespaces ``left`` and ``right``, each as in ``one_axis.launch.py``.

    ros2 launch fric_nodes two_axes.launch.py bags:=bags/my_run

An example, to be copied and changed. All topics are relative, so that a namespace is all that an axis needs.
"""

from __future__ import annotations

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration


def generate_launch_description() -> LaunchDescription:
    """What ``ros2 launch`` starts."""
    one_axis = str(Path(__file__).with_name("one_axis.launch.py"))
    axes = [
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(one_axis),
            launch_arguments={
                "namespace": name,
                "model_file": LaunchConfiguration("model_file"),
                "bag": [LaunchConfiguration("bags"), f"_{name}"],
            }.items(),
        )
        for name in ("left", "right")
    ]
    return LaunchDescription(
        [
            DeclareLaunchArgument("model_file", default_value="", description="fric-model/1 file of both compensators"),
            DeclareLaunchArgument("bags", default_value="bags/axis", description="beginning of the folders to record into"),
            *axes,
        ]
    )
