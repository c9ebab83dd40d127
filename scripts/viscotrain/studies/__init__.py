"""What one job computes: simulations of one geometry, and comparisons that verify them."""
