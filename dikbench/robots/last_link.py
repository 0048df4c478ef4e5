"""The link of a URDF that most joints move: a guess at its task frame."""

from __future__ import annotations

from xml.etree import ElementTree


def last_moved_link(path: str) -> str | None:
    """Find the link of a URDF that most joints move; None where there is none.

    Of several it is the one at the end of the longest chain of links, and the last one of these.

    Whatever else is wrong with a file is told where the robot is loaded.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError):
        return None
    above: dict[str, tuple[str, bool]] = {}
    for joint in root.iter("joint"):
        child, parent = joint.find("child"), joint.find("parent")
        if child is not None and parent is not None:
            moves = joint.get("type") != "fixed" and joint.find("mimic") is None
            above[child.get("link", "")] = (parent.get("link", ""), moves)
    best, most = None, (1, 0)
    for link in above:
        count, at, seen = 0, link, set[str]()
        while at in above and at not in seen:
            seen.add(at)
            at, moves = above[at]
            count += moves
        if (count, len(seen)) >= most:
            best, most = link, (count, len(seen))
    return best
