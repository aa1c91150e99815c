# ROS 2 from Python wheels: its prefix is that of the build's own (isolated) Python environment.

find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Module NumPy)

execute_process(
  COMMAND "${Python3_EXECUTABLE}" -c "import pathlib, rosidl_cmake; print(pathlib.Path(rosidl_cmake.__file__).parents[4])"
  OUTPUT_VARIABLE ros_prefix
  OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)
list(PREPEND CMAKE_PREFIX_PATH "${ros_prefix}")
set(ENV{AMENT_PREFIX_PATH} "${ros_prefix}")

# The published message packages export the Python headers of the machine they were built on.
# A target that exists already must lose every such path, and get that of the Python at hand.
function(repair_python_include_paths)
  foreach(package IN ITEMS builtin_interfaces service_msgs std_msgs unique_identifier_msgs action_msgs)
    find_package(${package} QUIET)
    set(target ${package}::${package}__rosidl_generator_py)
    if(NOT TARGET ${target})
      continue()
    endif()
    get_target_property(paths ${target} INTERFACE_INCLUDE_DIRECTORIES)
    set(kept ${Python3_INCLUDE_DIRS})
    foreach(path IN LISTS paths)
      if(path MATCHES "^\\$<" OR EXISTS "${path}")
        list(APPEND kept "${path}")
      endif()
    endforeach()
    set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${kept}")
  endforeach()
endfunction()
