"""Makers of problems, scenarios and rows of trials that several test modules share."""
