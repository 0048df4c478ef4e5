"""How a solver is called: cold, warm or through cvxpy."""
