"""Ways to solve the problem, and what to say of the outcome."""
