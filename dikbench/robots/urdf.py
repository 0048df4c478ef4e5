"""URDF files: the Pinocchio model, with mimic joints, and what Pinocchio does not refuse."""

from __future__ import annotations

import os.path
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping
from math import inf, isfinite, nan
from types import MappingProxyType
from typing import Any, Final, Literal, get_args

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError, unknown
from dikbench.robots.captured_stderr import captured_stderr
from dikbench.robots.mimic import UrdfJoint, followers, write_followers

Root = Literal["fixed", "planar", "free"]
"""What is between the world and the root link of a URDF: nothing, a planar joint, a free-flyer."""

ROOT_JOINTS: Final[Mapping[str, Callable[[], Any]]] = MappingProxyType(
    {"planar": pin.JointModelPlanar, "free": pin.JointModelFreeFlyer}
)
MOVING: Final = ("revolute", "continuous", "prismatic")
"""Types of joints with one coordinate, or (cos, sin)."""

XACRO: Final = "/xacro}"
"""The end of the namespace of xacro's elements."""

SHORTEST_AXIS: Final = 1e-9
"""An axis whose vector is shorter has no direction."""


def urdf_model(path: str, root: Root = "fixed") -> tuple[Any, list[UrdfJoint]]:
    """Build the Pinocchio model of a URDF; return it with the joints that follow others in it.

    Raises:
        DikbenchError: if the file is missing, is no URDF, or has a joint or a mass that makes no
            sense; the message names it.
    """
    if os.path.isdir(path):
        raise DikbenchError(f"robot file {path} is a folder; valid: the .urdf file in it")
    if not os.path.isfile(path):  # unlike Path.is_file, False for a name that is too long
        raise DikbenchError(f"robot file not found: {path}")
    if root not in get_args(Root):
        raise unknown("root", root, get_args(Root))
    document = _document(path)
    if any(XACRO in element.tag for element in document.iter()):
        raise DikbenchError(
            f"robot file {path} is a xacro file; run `xacro {path} > robot.urdf` and give that"
        )
    elements = {element.get("name", ""): element for element in document.findall("joint")}
    try:
        joints = [_joint(e) for e in elements.values() if e.get("type") in MOVING]
        for link in document.findall("link"):
            mass = link.find("inertial/mass")
            if mass is not None and _number(mass, "value", "mass") < 0:
                raise DikbenchError(f"link {link.get('name')!r} has a negative mass")
    except DikbenchError as error:
        raise DikbenchError(f"robot file {path}: {error}") from None
    model = _built(path, pin.buildModelFromUrdf, path, root)
    try:
        following = followers(joints, list(model.names))
    except DikbenchError as error:
        raise DikbenchError(f"robot file {path}: {error}") from None
    if following:
        write_followers(elements, following)
        text = ElementTree.tostring(document, encoding="unicode")
        model = _built(path, pin.buildModelFromXML, text, root, mimic=True)
    if model.nv == 0:
        raise DikbenchError(f"robot file {path}: the model has no moving joint")
    return model, following


def _document(path: str) -> ElementTree.Element:
    try:
        return ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise DikbenchError(f"robot file {path} is not a URDF, which is XML: {error}") from None
    except OSError as error:
        raise DikbenchError(f"robot file {path}: {error.strerror or error}") from None


def _built(path: str, build: Callable[..., Any], source: str, root: Root, **options: bool) -> Any:
    """Build a model with Pinocchio; its complaints become the message."""
    joint = () if root == "fixed" else (ROOT_JOINTS[root](),)
    with captured_stderr() as complaints:
        try:
            return build(source, *joint, **options)
        except (ValueError, RuntimeError) as error:
            reason = " ".join(f"{error} {complaints()}".split())
            raise DikbenchError(
                f"robot file {path} is not a URDF that Pinocchio reads: {reason}"
            ) from None


def _joint(element: ElementTree.Element) -> UrdfJoint:
    """Read a moving joint of a URDF and check it."""
    name = element.get("name", "")
    where = f"joint {name!r}"
    axis = element.find("axis")
    text = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
    try:
        length = float(np.linalg.norm([float(each) for each in text.split()]))
    except ValueError:
        length = nan
    if not (isfinite(length) and length > SHORTEST_AXIS):
        raise DikbenchError(f"{where} has the axis {text!r}; valid: a direction such as 0 0 1")
    lower, upper, velocity = -inf, inf, inf
    limit = element.find("limit")
    if limit is None and element.get("type") != "continuous":
        raise DikbenchError(
            f"{where} has no limits; valid: <limit lower upper velocity effort>, or type continuous"
        )
    if limit is not None:
        if element.get("type") != "continuous":
            lower, upper = (_number(limit, side, where) for side in ("lower", "upper"))
        for what in ("velocity", "effort"):
            if limit.get(what) is None:
                raise DikbenchError(f"{where} has a limit without {what}; valid: 0 for none")
            if _number(limit, what, where) < 0:
                raise DikbenchError(f"{where} has a negative {what} limit")
        velocity = _number(limit, "velocity", where) or inf
    if lower > upper:
        raise DikbenchError(f"{where} has a lower limit above its upper one: {lower:g} > {upper:g}")
    mimic = element.find("mimic")
    if mimic is None:
        return UrdfJoint(name, lower, upper, velocity)
    multiplier, offset = _number(mimic, "multiplier", where, 1.0), _number(mimic, "offset", where)
    return UrdfJoint(name, lower, upper, velocity, mimic.get("joint", ""), multiplier, offset)


def _number(element: ElementTree.Element, name: str, where: str, default: float = 0.0) -> float:
    """Read a number of an element."""
    text = element.get(name)
    try:
        value = default if text is None else float(text)
    except ValueError:
        value = nan
    if np.isnan(value):
        raise DikbenchError(f"{where}: {name}={text!r} is not a number")
    return value
