"""Studies, their trials, and the identity of a trial."""
