"""Robots: everything that the author of a robot imports.

A robot is a `CatalogueEntry`: a Pinocchio model and what a model file does not contain.
"""

from __future__ import annotations

from dikbench.robots.catalogue import CatalogueEntry
from dikbench.robots.denavit_hartenberg import denavit_hartenberg_arm
from dikbench.robots.example_robot_data import DataModel, joints
from dikbench.robots.loading import load_robot
from dikbench.robots.omnidirectional_base import omnidirectional_base
from dikbench.robots.planar_arm import planar_arm
from dikbench.robots.robot import Robot

__all__ = [
    "CatalogueEntry",
    "DataModel",
    "Robot",
    "denavit_hartenberg_arm",
    "joints",
    "load_robot",
    "omnidirectional_base",
    "planar_arm",
]
