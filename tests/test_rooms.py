"""The package has rooms: which one may import which, what must not need NGSolve, and sizes.

All of it is read from the syntax trees, imports inside functions included, so that a wrong import
is named with its line and nothing is imported here.
"""

import ast
import statistics
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

PACKAGE = Path(__file__).parents[1] / "scripts" / "viscotrain"
ROOMS = ("fluid", "flow", "table", "trains", "config", "studies", "drawing", "jobs")
NEVER_SEE_THE_CONFIG = ("fluid", "flow", "table", "trains")
SOLVER = ("ngsolve", "netgen", "pyngcore")
LONGEST_MODULE, LONGEST_FUNCTION, MEDIAN_BODY = 400, 60, 10  # lines

# What is allowed for now; a rule that no longer needs its exception fails, so that this empties.
ARROWS_TO_BE_TURNED: set[tuple[str, str]] = set()
LONG_MODULES: set[str] = set()
LONG_FUNCTIONS: set[str] = set()


class Arrow(NamedTuple):
    """An import of one module of the package by another, or of something outside."""

    source: str
    target: str
    place: str  # file:line


def files() -> dict[str, Path]:
    """Modules by their dotted name below the package; a room's own is named like the room."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(part for part in parts if part != "__init__")] = path
    return found


MODULES = files()
TREES = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in MODULES.items()}


def arrows(name: str, tree: ast.Module) -> Iterator[Arrow]:
    """Everything that a module imports; the modules of a package that `from` names, one by one."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{MODULES[name]}:{node.lineno}: a relative import"
            inside = [f"{node.module}.{alias.name}" for alias in node.names]
            targets = [t if _module(t) in MODULES else node.module for t in inside]
        else:
            continue
        for target in targets:
            place = f"{MODULES[name].relative_to(PACKAGE.parents[1])}:{node.lineno}"
            yield Arrow(name, target, f"{place}: imports {target}")


def _module(target: str) -> str | None:
    """Name below the package of a module of it."""
    if target == "viscotrain":
        return ""
    return target.removeprefix("viscotrain.") if target.startswith("viscotrain.") else None


def room(name: str) -> str:
    """The room of a module; empty for the root."""
    return name.split(".")[0] if name.split(".")[0] in ROOMS else ""


ARROWS = [arrow for name, tree in TREES.items() for arrow in arrows(name, tree)]
INSIDE = [arrow for arrow in ARROWS if _module(arrow.target) is not None]
FROM = {name: [arrow for arrow in INSIDE if arrow.source == name] for name in MODULES}


def is_hand_out(arrow: Arrow) -> bool:
    """Whether it is one of the public names, which the package hands out when asked."""
    return arrow.source == "" and room(_module(arrow.target) or "") in ("table", "trains")


def height(name: str) -> int:
    """Position of a module's room in the order of rooms; the root comes before them."""
    return ROOMS.index(room(name)) if room(name) else -1


def test_every_module_is_in_a_room():
    assert {name for name in MODULES if not room(name)} == {"", "errors", "files", "words"}


def test_tests_stand_in_the_same_rooms():
    folders = {path.parent.name for path in Path(__file__).parent.glob("*/test_*.py")}
    assert folders == {*ROOMS, "workflow"}


def test_every_module_has_a_trade_that_its_first_line_names():
    firsts = [(ast.get_docstring(tree) or "").partition("\n")[0] for tree in TREES.values()]
    assert all(len(line) > 10 for line in firsts)
    assert len(set(firsts)) == len(firsts)


def test_names_of_modules_are_unique_and_not_those_of_rooms():
    last = [name.split(".")[-1] for name in MODULES if "." in name]
    assert len(set(last)) == len(last)
    assert not set(last) & set(ROOMS)


def test_every_import_names_a_module_that_exists():
    wrong = [arrow.place for arrow in INSIDE if _module(arrow.target) not in MODULES]
    assert not wrong, "\n".join(wrong)


def test_rooms_import_only_rooms_above_them():
    backwards = [
        arrow
        for arrow in INSIDE
        if height(_module(arrow.target)) > height(arrow.source) and not is_hand_out(arrow)
    ]
    allowed = [a for a in backwards if (a.source, _module(a.target)) in ARROWS_TO_BE_TURNED]
    wrong = [arrow.place for arrow in backwards if arrow not in allowed]
    assert not wrong, "\n".join(wrong)
    assert {(a.source, _module(a.target)) for a in allowed} == ARROWS_TO_BE_TURNED


def test_no_two_modules_import_each_other():
    """No circles within a room either."""
    graph = {name: set() for name in MODULES}
    for arrow in INSIDE:
        if not is_hand_out(arrow):
            graph[arrow.source].add(_module(arrow.target))
    while leaves := {name for name, targets in graph.items() if not targets & graph.keys()}:
        graph = {name: targets for name, targets in graph.items() if name not in leaves}
    assert not graph, f"in circles, or imported by them: {sorted(graph)}"


def test_physics_takes_numbers_and_never_sees_the_config():
    wrong = [
        arrow.place
        for arrow in INSIDE
        if room(arrow.source) in NEVER_SEE_THE_CONFIG and room(_module(arrow.target)) == "config"
    ]
    assert not wrong, "\n".join(wrong)


def closure(start: str) -> set[str]:
    """The module and everything of the package that importing it imports, rooms included."""
    found, todo = set(), [start]
    while todo:
        name = todo.pop()
        if name in found:
            continue
        found.add(name)
        todo += [_module(a.target) for a in FROM.get(name, ()) if not is_hand_out(a)]
        todo += [".".join(name.split(".")[:depth]) for depth in range(name.count(".") + 1)]
    return found


@pytest.mark.parametrize(
    "start",
    [name for name in MODULES if room(name) in ("drawing", "table", "trains", "config")],
)
def test_what_draws_or_opens_a_table_needs_no_solver(start):
    reached = closure(start)
    wrong = [
        arrow.place
        for arrow in ARROWS
        if arrow.source in reached and arrow.target.split(".")[0] in SOLVER
    ]
    assert not wrong, f"{start} reaches " + "\n".join(wrong)


@pytest.mark.parametrize(
    "start",
    ["config.stages", "config.reading", "jobs.digests", "jobs.resources", "words", "errors"],
)
def test_the_config_is_read_without_numpy(start):
    heavy = ("numpy", "scipy", "xarray", "pandas")
    reached = closure(start)
    wrong = [
        arrow.place
        for arrow in ARROWS
        if arrow.source in reached and arrow.target.split(".")[0] in heavy
    ]
    assert not wrong, "\n".join(wrong)


def functions(tree: ast.AST, prefix: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    """All functions and methods with their dotted names."""
    for node in ast.iter_child_nodes(tree):
        name = f"{prefix}.{node.name}" if hasattr(node, "name") else prefix
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield name, node
        yield from functions(node, name)


def lines_of(function: ast.FunctionDef) -> int:
    return function.end_lineno - function.lineno + 1


def body_of(function: ast.FunctionDef) -> int:
    """Lines of the body, without its docstring."""
    first = function.body[0]
    if ast.get_docstring(function) is not None:
        if len(function.body) == 1:
            return 0
        first = function.body[1]
    return function.end_lineno - first.lineno + 1


def test_no_module_is_long():
    found = {
        name
        for name, path in MODULES.items()
        if len(path.read_text(encoding="utf-8").splitlines()) > LONGEST_MODULE
    }
    assert found == LONG_MODULES


def test_no_function_is_long():
    found = {
        name
        for module, tree in TREES.items()
        for name, function in functions(tree, module)
        if lines_of(function) > LONGEST_FUNCTION
    }
    assert found == LONG_FUNCTIONS


def test_half_of_the_functions_have_short_bodies():
    bodies = [
        body_of(function) for name, tree in TREES.items() for _, function in functions(tree, name)
    ]
    assert statistics.median(bodies) <= MEDIAN_BODY
