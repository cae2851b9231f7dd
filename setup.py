"""What stands beside the package in the repository, and inside of it in a wheel; all else: pyproject.toml."""

from setuptools import find_namespace_packages, setup

BESIDE = ("scenarios", "examples")

packages = find_namespace_packages(include=["twin", "twin.*"])
for folder in BESIDE:
    inner = find_namespace_packages(folder)
    packages += [f"twin.{folder}", *(f"twin.{folder}.{each}" for each in inner if "__pycache__" not in each)]

setup(packages=packages, package_dir={f"twin.{folder}": folder for folder in BESIDE})
