"""Controllers and their tuning, without ROS: numbers in, numbers out, seconds throughout."""
