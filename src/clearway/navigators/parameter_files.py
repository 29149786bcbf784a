"""Users' own parameter files, those of a robot that runs ROS: what becomes of each parameter in them."""

from __future__ import annotations

from pathlib import Path

from clearway.navigators.common.parameter_table import ParameterTable
from clearway.navigators.move_base.ros import is_ros_folder
from clearway.navigators.move_base.ros import table as of_move_base
from clearway.navigators.nav2.parameters.file import is_ros_parameters
from clearway.navigators.nav2.parameters.table import table as of_nav2
from clearway.robots import load_robot


def parameter_table(target: str | Path, robot: str | None = None) -> ParameterTable | None:
    """What becomes of the parameters in a file of Nav2's, or in the files of a ROS 1 package; None of anything else.

    Args:
        target: The file; or a folder, or several of folders and files joined by `+`.
        robot: Who would drive with them: by its name a file is chosen where a package has one for each of several, by its lidar the
            heights of Nav2's costmaps are judged. None: nobody in particular.

    Raises:
        ClearwayError: it is such a file or folder, and can't be read, or for a file of Nav2's there is no such robot.
    """
    if is_ros_folder(str(target)):
        return of_move_base(str(target), robot or "")
    path = Path(target)
    if path.suffix in (".yaml", ".yml") and is_ros_parameters(path):
        return of_nav2(path, None if robot is None else load_robot(robot))
    return None
