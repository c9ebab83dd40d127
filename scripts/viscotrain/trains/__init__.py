"""Trains of many spheres that move by the table, their statistics and the design map."""
