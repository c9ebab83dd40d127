"""What code a result rests on: the digest of everything that a script imports.

The digest of a rule is that of its script and of all modules of the package that the script
reaches, imports inside functions included, minus those in `WITHOUT_NUMBERS`. It is computed on
syntax trees without docstrings (comments are not in them), so that it changes when the numbers may
have changed, and not when a text is edited or another version of Python reads it. The workflow
passes it to its rules, which Snakemake then repeats; datasets hold it. A module that is forgotten
nowhere cannot leave a stale number: at worst one that is reached for its words repeats a job.
"""

import ast
import functools
import hashlib
import sys
from collections.abc import Iterator
from pathlib import Path

SCRIPTS = Path(__file__).parents[2]
PACKAGE = Path(__file__).parents[1]

# What cannot change a number, though scripts reach it. Names of modules and of whole rooms.
WITHOUT_NUMBERS = {
    "errors",  # how a refusal is worded
    "files",  # how files are read and written
    "table.attributes",  # what variables are called
    "jobs",  # how scripts are called, and how files are written
    "config",  # what may be asked for: it reaches a job as settings, which rules state
}
NUMBERS_AFTER_ALL = {
    "config.settings",
    "config.device_settings",
}  # ... except what a job computes from these


def digest(script: str | Path) -> str:
    """Hexadecimal digest of a script and all that it reaches; `script` is a name or a path."""
    path = Path(script)
    if not path.suffix:
        path = SCRIPTS / f"{script}.py"
    return _digest(path.resolve(), PACKAGE)


@functools.cache
def _digest(script: Path, package: Path) -> str:
    hasher = hashlib.sha256(_code(script).encode())
    for name in sorted(reached(script, package)):
        hasher.update(f"\n{name}\n{_code(_file(name, package))}".encode())
    return hasher.hexdigest()[:16]


def reached(script: Path, package: Path = PACKAGE) -> set[str]:
    """Modules of the package that a script imports, themselves or by others, named with rooms."""
    found: set[str] = set()
    todo = [script]
    while todo:
        new = {name for name in _imports(todo.pop(), package) if _counts(name)} - found
        found |= new
        todo += [_file(name, package) for name in new]
    return found


def _counts(name: str) -> bool:
    if name in NUMBERS_AFTER_ALL:
        return True
    return name not in WITHOUT_NUMBERS and name.split(".")[0] not in WITHOUT_NUMBERS


def _file(name: str, package: Path) -> Path:
    return package.joinpath(*name.split(".")).with_suffix(".py")


@functools.cache
def _imports(path: Path, package: Path) -> frozenset[str]:
    """Modules of the package that a file names; a room's own file, a title, is none."""
    names, _ = _parsed(path.read_text(encoding="utf-8"))
    inside = {
        name.removeprefix(f"{package.name}.") for name in names if name.startswith(package.name)
    }
    return frozenset(name for name in inside if _file(name, package).is_file())


def _code(path: Path) -> str:
    return _parsed(path.read_text(encoding="utf-8"))[1]


@functools.cache
def _parsed(text: str) -> tuple[frozenset[str], str]:
    """What a file of this text imports, and its syntax tree as text, without docstrings."""
    tree = ast.parse(text)
    names: set[str] = set()
    for node in ast.walk(tree):
        names.update(_named(node))
        if isinstance(node, ast.JoinedStr):  # 3.12 has an empty text behind {value:{form}}
            node.values = [part for part in node.values if getattr(part, "value", None) != ""]
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if ast.get_docstring(node, clean=False) is not None:
            node.body = node.body[1:]
    return frozenset(names), _dump(tree)


def _dump(tree: ast.AST) -> str:
    """Text of a syntax tree as Python 3.11 has it: 3.12 adds a field, 3.13 hides empty ones."""
    everything = {"show_empty": True} if sys.version_info >= (3, 13) else {}
    return ast.dump(tree, **everything).replace(", type_params=[]", "")


def _named(node: ast.AST) -> Iterator[str]:
    """Everything that an import may mean by a module."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and node.module:
        yield node.module
        yield from (f"{node.module}.{alias.name}" for alias in node.names)
