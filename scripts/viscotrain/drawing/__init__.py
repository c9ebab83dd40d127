"""Figures, movies and the interactive page; nothing here needs NGSolve."""
