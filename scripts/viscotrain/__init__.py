"""viscotrain: particle trains in viscoelastic tube flow, from a config file to figures.

The package has rooms; each imports from those above it only, and `tests/test_rooms.py` checks it:

    (root)    errors, and the words that all share
    fluid     parameters and scales, rheology, measured data and the fit to them
    flow      equations, meshes, the discrete problem and its solution
    table     velocities of three spheres at any two distances
    trains    many spheres that move by the table, design map
    config    what a study may ask for
    studies   what one job computes
    drawing   figures, movies, interactive page
    jobs      how scripts run: messages, files, provenance, progress

A notebook that reads a table needs one name, `from viscotrain import VelocityTable`.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viscotrain.table.interpolation import VelocityTable

__all__ = ["VelocityTable"]
__version__ = "0.1.0"


def __getattr__(name: str):
    """The public names, imported when they are first asked for (PEP 562)."""
    if name == "VelocityTable":
        from viscotrain.table.interpolation import VelocityTable

        return VelocityTable
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
