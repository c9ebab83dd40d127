"""The oldest versions that `pyproject.toml` allows, as constraints for pip.

python scripts/tools/lowest_versions.py > lowest.txt && pip install -e ".[test]" -c lowest.txt
"""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"


def constraints(project: dict) -> Iterator[str]:
    """`name==version` of every requirement, extras included.

    Args:
        project: The table `project` of a pyproject.toml.

    Raises:
        ValueError: A requirement has no lower bound.
    """
    extras = project.get("optional-dependencies", {}).values()
    for requirement in [*project["dependencies"], *(line for lines in extras for line in lines)]:
        found = re.fullmatch(r"([\w.-]+)(?:\[[\w,-]+\])?[>=]=([\w.]+)", requirement)
        if not found:
            raise ValueError(f"found {requirement!r}; allowed: name>=version or name==version")
        yield f"{found[1]}=={found[2]}"


if __name__ == "__main__":
    print("\n".join(constraints(tomllib.loads(PYPROJECT.read_text("utf-8"))["project"])))
