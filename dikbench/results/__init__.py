"""Data at rest: the store of a run, its exports, and their one reader."""
