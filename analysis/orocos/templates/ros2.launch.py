# {mark}: change the model, not this file.

from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch.substitutions import PathJoinSubstitution
from launch_ros.substitutions import FindPackagePrefix


def generate_launch_description():
    program = PathJoinSubstitution(
        {command}
    )
    return LaunchDescription([ExecuteProcess(cmd=[program], output='screen')])
