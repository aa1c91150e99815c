"""Experiments that conduct themselves: excite, record, identify, choose the next setting; no ROS in here."""
