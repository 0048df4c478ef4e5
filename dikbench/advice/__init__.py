"""Advice: the worst case of a formulation, and which formulation suits one's own arm."""
