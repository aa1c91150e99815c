"""Build of the package fric_nodes by colcon (ament_python); `pip install .` takes the pyproject.toml of the root."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "fric_nodes"
# colcon may run this file through a link, from another folder: paths are found from the file itself
HERE = Path(__file__).resolve().parent
NODES = (HERE / "resource" / "executables").read_text(encoding="utf-8").split()
MANIFEST = ElementTree.parse(HERE / "package.xml").getroot()


def from_here(paths: list[Path]) -> list[str]:
    """The paths relative to the working directory, the only form that setuptools takes."""
    return [os.path.relpath(path) for path in sorted(paths)]


setup(
    name=NAME,
    version=MANIFEST.findtext("version"),
    description=MANIFEST.findtext("description"),
    license=MANIFEST.findtext("license"),
    maintainer=MANIFEST.findtext("maintainer"),
    packages=find_packages(include=["fric", "fric.*", NAME, f"{NAME}.*"]),
    package_data={
        "fric": ["py.typed", *(f"**/*.{kind}" for kind in ("html", "css", "js", "json", "svg", "yaml", "c", "h"))],
        NAME: ["py.typed"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", from_here([HERE / "resource" / NAME])),
        (f"share/{NAME}", from_here([HERE / "package.xml"])),
        (f"share/{NAME}/config", from_here(list((HERE.parent / "config").glob("*.yaml")))),
        (f"share/{NAME}/launch", from_here(list((HERE / "launch").glob("*.launch.py")))),
        ("bin", from_here([HERE / "resource" / "bin" / "fric"])),  # colcon puts this folder on the PATH
    ],
    python_requires=">=3.10",
    install_requires=["setuptools"],
    zip_safe=False,
    entry_points={
        "console_scripts": [f"{node} = {NAME}.nodes.{node}:main" for node in NODES] + ["fric = fric_nodes.cli.main:main"],
        "fric.plugins": ["fric_nodes = fric_nodes"],
        "ros2doctor.checks": ["FricCheck = fric_nodes.ros2_doctor:InstallationCheck"],
        "ros2doctor.report": ["FricReport = fric_nodes.ros2_doctor:InstallationReport"],
    },
)
