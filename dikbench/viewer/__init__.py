"""A trial in the browser: the robot moving along its trace."""
