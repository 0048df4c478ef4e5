"""Stored results: the store of a run, its exports, and their reader."""
