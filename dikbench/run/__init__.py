"""Running a study: worker processes, the timing pass, and what is written down."""
