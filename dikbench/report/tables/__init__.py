"""The tables of a report: what they hold, their numbers, and how they are written."""
