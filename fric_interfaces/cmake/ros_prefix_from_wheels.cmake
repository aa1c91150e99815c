# ROS 2 from Python wheels lies under the prefix of the build's own (isolated) Python environment.

find_package(Python3 COMPONENTS Interpreter Development.Module)
if(NOT Python3_Development.Module_FOUND)
  message(FATAL_ERROR "The C headers of Python ${Python3_VERSION} are not there: install them (Debian, Ubuntu: python3-dev).")
endif()

execute_process(
  COMMAND "${Python3_EXECUTABLE}" -c "import pathlib, rosidl_pycommon as r; print(pathlib.Path(r.__file__).parents[4])"
  OUTPUT_VARIABLE ros_prefix
  OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)
list(PREPEND CMAKE_PREFIX_PATH "${ros_prefix}")
set(ENV{AMENT_PREFIX_PATH} "${ros_prefix}")
