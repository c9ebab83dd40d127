"""Exceptions of viscotrain: one base class, and each child also is a standard exception."""

from collections.abc import Sequence

MOST_PROBLEMS = 40  # lines of a message


class ViscotrainError(Exception):
    """Base class of everything that viscotrain raises on purpose."""


class ConfigError(ViscotrainError, ValueError):
    """A config is wrong; the message lists all its problems, one per line.

    Args:
        source: What was read, usually the file's path.
        problems: One line of text per problem, each beginning with the key it is about.
    """

    def __init__(self, source: str, problems: Sequence[str]):
        self.source = source
        self.problems = tuple(problems)
        count = f"{len(self.problems)} problem" + ("s" if len(self.problems) != 1 else "")
        shown = list(self.problems[:MOST_PROBLEMS])
        if len(self.problems) > MOST_PROBLEMS:
            shown.append(f"... and {len(self.problems) - MOST_PROBLEMS} more")
        super().__init__("\n".join([f"{source}: {count}", *(f"  {p}" for p in shown)]))

    def __reduce__(self):
        """Rebuild from the two arguments: jobs send exceptions between processes."""
        return type(self), (self.source, self.problems)


class FluidError(ViscotrainError, ValueError):
    """A set of fluid parameters has no meaning."""


class TableError(ViscotrainError, ValueError):
    """A velocity table cannot be built, or is asked for what it does not hold."""


class GeometryError(ViscotrainError, ValueError):
    """Spheres that do not fit."""


class TrainError(ViscotrainError, ValueError):
    """A train cannot be simulated as asked."""


class SolutionError(ViscotrainError, RuntimeError):
    """A flow that is needed was not solved."""


class RunError(ViscotrainError, RuntimeError):
    """A study cannot be run now."""


class FileError(ViscotrainError, OSError):
    """A file cannot be written, or is not what it should be."""


class DataError(ViscotrainError, ValueError):
    """Measured data are wrong, or cannot determine what is fitted to them."""
