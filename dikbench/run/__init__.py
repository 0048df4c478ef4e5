"""Running a study: worker processes, the timing pass, and provenance."""
