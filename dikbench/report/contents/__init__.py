"""What a report holds: the laws, families and references of its rows."""
