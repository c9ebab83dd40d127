"""Where a dataset comes from: physics digest, software versions, git commit.

The digest is computed on syntax trees without docstrings (comments are not in them), so that it
changes when the physics may have changed, and not when a text is edited. The workflow passes it to
the costly rules, which Snakemake then repeats; datasets store it.
"""

import ast
import functools
import hashlib
import importlib.metadata
import subprocess
from pathlib import Path

import xarray as xr

PACKAGE = Path(__file__).parents[1]
# What an edit must repeat; a stage whose input changes is repeated anyway.
PHYSICS = (  # modules that decide the numbers of the direct numerical simulation
    "words",
    "fluid.parameters",
    "fluid.pipe",
    "fluid.shear",
    "flow.axisymmetry",
    "flow.batches",
    "flow.continuation",
    "flow.quasi_steady",
    "flow.discretisation",
    "flow.elements",
    "flow.factorisation",
    "flow.fronts",
    "flow.geometry",
    "flow.giesekus",
    "flow.jets",
    "flow.meshes",
    "flow.newton",
    "flow.refinement",
    "flow.weak_forms",
    "studies.dns",
)
TRANSIENT = (*PHYSICS, "flow.moving_mesh", "flow.time_stepping", "studies.transient")
FIELD = (*PHYSICS, "flow.fields")
FLUID_FIT = (  # ... the fitted fluid
    "fluid.parameters",
    "fluid.measurements",
    "fluid.fit_problem",
    "fluid.fit_report",
    "fluid.fluid_fit",
    "fluid.rheology",
    "fluid.shear",
)
TABLE = (  # ... the table, given those
    "words",
    "table.assembly",
    "table.attributes",
    "table.check",
    "table.description",
    "table.interpolation",
    "table.lubrication",
    "table.pairs",
    "table.points",
    "table.present",
    "table.triplets",
)
TRAINS = (  # ... the trains, given the table
    "words",
    "fluid.parameters",
    "table.interpolation",
    "table.lubrication",
    "trains.injection",
    "trains.motion",
    "trains.repeats",
    "trains.recording",
    "trains.statistics",
)
MOVIES = (
    "drawing.canvas",
    "drawing.encoding",
    "drawing.movies",
    "trains.films",
)  # ... movies, given trains
INTERACTIVE = (  # ... the page for the browser
    "drawing.interactive",
    "table.interpolation",
    "table.lubrication",
    "table.pairs",
)
DESIGN_MAP = (  # ... the map, given its trains
    "trains.design_map",
    "fluid.parameters",
    "fluid.pipe",
    "fluid.shear",
)
START_UP = ("studies.start_up",)  # ... the comparison, given the transient
CLOSURE_TRAIN = (
    *TRANSIENT,
    "table.interpolation",
    "table.lubrication",
    "trains.motion",
    "studies.closure",
    "studies.resolution",
)
CLOSURE_GAP = (*PHYSICS, "studies.closure")
CONVERGENCE = (*TRANSIENT, "studies.convergence", "studies.resolution")
SOFTWARE = ("viscotrain", "ngsolve", "netgen-mesher", "numpy", "scipy", "xarray")


def digest(modules: tuple[str, ...], package: Path = PACKAGE) -> str:
    """Hexadecimal digest of the code of some modules of the package, named with their rooms."""
    hasher = hashlib.sha256()
    for name in modules:
        tree = ast.parse(
            package.joinpath(*name.split(".")).with_suffix(".py").read_text(encoding="utf-8")
        )
        hasher.update(f"{name}\n{ast.dump(_without_docstrings(tree))}\n".encode())
    return hasher.hexdigest()[:16]


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if ast.get_docstring(node, clean=False) is not None:
            node.body = node.body[1:]
    return tree


@functools.cache
def software_versions() -> str:
    """Installed versions as one line of text; packages that are not installed are left out."""
    found = []
    for name in SOFTWARE:
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return ", ".join(found)


@functools.cache
def git_commit() -> str:
    """Commit of the source tree, marked if tracked files differ from it; else "unknown"."""
    command = ["git", "-C", str(PACKAGE), "describe", "--always", "--abbrev=40", "--dirty=+edited"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
    except OSError:
        return "unknown"
    return answer.stdout.strip() if answer.returncode == 0 else "unknown"


def attributes(title: str, study_config: str) -> dict[str, str]:
    """Global attributes of a dataset (CF conventions); no wall clock, so bytes can be compared.

    Args:
        title: What the dataset holds.
        study_config: The resolved config as YAML text.
    """
    return {
        "Conventions": "CF-1.11",
        "title": title,
        "source": f"viscotrain, {software_versions()}",
        "history": f"made by viscotrain at commit {git_commit()}",
        "references": "equations and their sources: module headers of viscotrain",
        "git_commit": git_commit(),
        "software_versions": software_versions(),
        "physics_digest": digest(PHYSICS),
        "study_config": study_config,
    }


def stamped(dataset: xr.Dataset, study_config: str) -> xr.Dataset:
    """A dataset that has a title, with all global attributes.

    Args:
        dataset: What a study has computed.
        study_config: The resolved config as YAML text.
    """
    return dataset.assign_attrs(attributes(dataset.attrs["title"], study_config))
