"""What a report holds: the formulations, families and references of its rows."""
