"""Blocks of a page that a program writes, between `<!-- NAME: begin -->` and the same with end."""

import sys
from collections.abc import Mapping
from pathlib import Path


def markers(name: str) -> tuple[str, str]:
    """The lines around the block of a name."""
    return f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"


def filled(text: str, blocks: Mapping[str, str]) -> str:
    """A page with new blocks.

    Raises:
        ValueError: A block has no place in the page.
    """
    for name, block in blocks.items():
        begin, end = markers(name)
        before, found, rest = text.partition(begin)
        _, closed, after = rest.partition(end)
        if not (found and closed):
            raise ValueError(f"no place for the block {name!r}; allowed: one with both its markers")
        text = f"{before}{begin}\n{block.strip()}\n\n{end}{after}"
    return text


def write(pages: Mapping[Path, str], check: bool, command: str):
    """Write pages that differ from what they should say, or exit with 1 with `check`."""
    stale = [path for path, text in pages.items() if path.read_text(encoding="utf-8") != text]
    for path in stale:
        if check:
            print(f"{path.name} is out of step: run {command}")
        else:
            path.write_text(pages[path], encoding="utf-8")
            print(f"{path.name} written")
    if check and stale:
        sys.exit(1)
