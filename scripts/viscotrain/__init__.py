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

A notebook needs the names below: `from viscotrain import VelocityTable`. They are imported when
they are first asked for, and none of them needs the solver.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viscotrain.errors import TableError, ViscotrainError
    from viscotrain.table.interpolation import TripletVelocities, VelocityTable
    from viscotrain.trains.order import orders
    from viscotrain.trains.repeats import run_repeats

PLACES = {
    "VelocityTable": "table.interpolation",
    "TripletVelocities": "table.interpolation",
    "run_repeats": "trains.repeats",
    "orders": "trains.order",
    "ViscotrainError": "errors",
    "TableError": "errors",
}
__all__ = [
    "TableError",
    "TripletVelocities",
    "VelocityTable",
    "ViscotrainError",
    "orders",
    "run_repeats",
]
__version__ = "1.0.0"


def __getattr__(name: str):
    """The public names, imported when they are first asked for (PEP 562)."""
    if name in PLACES:
        return getattr(importlib.import_module(f"{__name__}.{PLACES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """What completion offers."""
    return __all__
