"""Tuning: every formulation gets the same number of tries on the train split."""
