"""Quadratic programs, programs written in cvxpy, and the answer to one."""
