"""Desired motions of the task frame: references, curves, waypoints, pose files."""
