"""What is solved: quadratic programs, programs in cvxpy's words, and the answer to one."""
