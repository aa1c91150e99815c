"""Benchmarks that need the ROS graph; ``fric bench`` finds them as it finds those of a plugin."""
