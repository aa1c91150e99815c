# What `ros2 run fric_nodes NODE` looks for under the prefix. colcon installs the same from fric_nodes/setup.py.

set(nodes_dir "${CMAKE_CURRENT_SOURCE_DIR}/../fric_nodes")

install(FILES "${nodes_dir}/resource/fric_nodes" DESTINATION share/ament_index/resource_index/packages)
install(FILES "${nodes_dir}/package.xml" DESTINATION share/fric_nodes)
install(DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/../config/" DESTINATION share/fric_nodes/config FILES_MATCHING PATTERN "*.yaml")

install(DIRECTORY "${nodes_dir}/launch/" DESTINATION share/fric_nodes/launch FILES_MATCHING PATTERN "*.launch.py")

file(STRINGS "${nodes_dir}/resource/executables" node_names)
foreach(node IN LISTS node_names)
  configure_file("${CMAKE_CURRENT_LIST_DIR}/executable.in" "${CMAKE_CURRENT_BINARY_DIR}/executables/${node}" @ONLY)
  install(PROGRAMS "${CMAKE_CURRENT_BINARY_DIR}/executables/${node}" DESTINATION lib/fric_nodes)
endforeach()
