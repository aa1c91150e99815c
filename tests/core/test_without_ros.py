"""Outside nodes/ nothing needs ROS: everything else imports where rclpy and fric_interfaces do not exist."""

from __future__ import annotations

import subprocess
import sys

SCRIPT = """
import importlib, pkgutil, sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {"rclpy", "fric_interfaces", "sensor_msgs", "std_msgs", "diagnostic_msgs", "rcl_interfaces"}:
            raise ModuleNotFoundError(f"blocked for this test: {name}", name=name)
        return None

sys.meta_path.insert(0, NoRos())
import fric_nodes
names = [
    info.name
    for info in pkgutil.walk_packages(fric_nodes.__path__, "fric_nodes.", onerror=lambda name: None)
    if not info.name.startswith("fric_nodes.nodes")
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


def test_everything_outside_nodes_imports_without_ros() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=100, check=False)
    count, *failed = done.stdout.splitlines()
    assert done.returncode == 0, "\n".join(failed) + done.stderr
    assert int(count) > 50
