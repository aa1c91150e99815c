"""The library needs no ROS: all of it imports where rclpy and fric_interfaces do not exist."""

from __future__ import annotations

import subprocess
import sys

SCRIPT = """
import importlib, pkgutil, sys

BLOCKED = {"rclpy", "fric_interfaces", "sensor_msgs", "std_msgs", "diagnostic_msgs", "rcl_interfaces"}

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in BLOCKED:
            raise ModuleNotFoundError(f"blocked for this test: {name}", name=name)
        return None

sys.meta_path.insert(0, NoRos())
import fric
names = [
    info.name
    for info in pkgutil.walk_packages(fric.__path__, "fric.", onerror=lambda name: None)
]
failed = []
for name in names:
    try:
        importlib.import_module(name)
    except Exception as error:
        failed.append(f"{name}: {type(error).__name__}: {error}")
print(len(names))
print("\\n".join(failed))
assert "rclpy" not in sys.modules
sys.exit(bool(failed))
"""


def test_the_library_imports_without_ros() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=100, check=False)
    count, *failed = done.stdout.splitlines()
    assert done.returncode == 0, "\n".join(failed) + done.stderr
    assert int(count) > 50
