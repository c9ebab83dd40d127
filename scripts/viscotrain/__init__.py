"""viscotrain: particle trains in viscoelastic tube flow, from a config file to figures.

The stages follow each other in one direction, one module each:
config -> meshes -> dns -> table -> trains -> figures.
"""

__version__ = "0.1.0"
