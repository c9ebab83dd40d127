"""Reading those parts of a config that are right although others are wrong."""

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any

from viscotrain.config.wording import Problem, shown


class Unreadable(Exception):
    """A check needs a key that is missing or wrong itself."""


class Readable:
    """The part of a config that can be checked although other parts are wrong."""

    def __init__(self, data: Any, wrong: Collection[tuple] = ()):
        self._data = data
        self._wrong = wrong

    def value(self, key: str) -> Any:
        """The value of a dotted key, or `Unreadable`."""
        path = tuple(key.split("."))
        value = self._data
        for depth in range(len(path) + 1):
            if path[:depth] in self._wrong:
                raise Unreadable(key)
            if depth:
                try:
                    value = value[path[depth - 1]]
                except (KeyError, TypeError) as error:
                    raise Unreadable(key) from error
        return value

    def items(self, key: str) -> list:
        """The items of a list, None in the place of a wrong one; none of a key that is null."""
        path = tuple(key.split("."))
        items = enumerate(self.value(key) or ())
        return [None if (*path, index) in self._wrong else item for index, item in items]

    def indexed(self, key: str) -> list[tuple[tuple, Any]]:
        """Location and value of the items of a list that are right, or of a single value.

        None of a key that is left to the default, null.
        """
        path = tuple(key.split("."))
        if self.value(key) is None:
            return []
        if not isinstance(self.value(key), Sequence):
            return [(path, self.value(key))]
        return [((*path, i), item) for i, item in enumerate(self.items(key)) if item is not None]


Check = Callable[[Readable], Iterator[Problem]]


def conflict(location: tuple, found: Any, allowed: str) -> Problem:
    """A problem of two keys."""
    return Problem(location, f"found {shown(found)}; allowed: {allowed}")
