"""The package for colcon and for pip."""

from glob import glob

from setuptools import setup

NAME = "mrol_ros"

setup(
    name=NAME,
    version="0.2.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
        (f"share/{NAME}/config", glob("config/*.yaml")),
    ],
    install_requires=["setuptools", "numpy", "mrol"],
    zip_safe=True,
    maintainer="mrol",
    maintainer_email="nobody@example.org",
    description="A robot of ROS 2 on an mrol server",
    license="MIT",
    entry_points={"console_scripts": [f"node = {NAME}.node:main"]},
)
