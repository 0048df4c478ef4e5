"""A trial in the browser: the robot moving along its trace.

What a page with scenes of its own needs: `static_scene`, `viser_client`, `moving_joints`,
`limit_use`, `legend`.
"""
