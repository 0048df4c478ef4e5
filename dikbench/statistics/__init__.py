"""Statistics over trials: failures, means, intervals, profiles. One concept per file."""
