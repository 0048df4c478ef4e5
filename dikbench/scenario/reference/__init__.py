"""What the task frame is to do: references, curves, waypoints, pose files."""
