"""The package that is built from the tree: whole, and enough by itself for tables and trains."""

import shutil
import zipfile
from pathlib import Path

import pytest
from harness import FINISHED_TABLE, ROOT, SCRIPTS, output, run_python

BUILT_FROM = ("pyproject.toml", "README.md", "LICENSE")
USES_A_TABLE = """
import sys
from viscotrain import VelocityTable, orders, run_repeats

table = VelocityTable.open(sys.argv[1])
of_three = table.at(5)(1.3, 2.0)
assert of_three.shape == (3,) and 1.6 < of_three.min() < of_three.max() < 1.7
assert orders(table, table.confinement, spacing=[3.0])["stability"].sel(deborah=5) == 1
train = run_repeats(
    table.at(5),
    confinement=table.confinement,
    centreline_velocity=table.centreline_velocity(5),
    volume_fraction=0.01,
    length=20,
    stations=[0, 20],
    passages=10,
    repeats=1,
    seed=1,
)
assert train["spacing"].notnull().all() and train["spacing"].min() > 1
assert not any(m.split(".")[0] in ("ngsolve", "netgen", "pyngcore") for m in sys.modules)
print(sys.modules["viscotrain"].__file__)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built in a copy, so that nothing an earlier build has left gets in."""
    folder = tmp_path_factory.mktemp("wheel")
    ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
    shutil.copytree(SCRIPTS, folder / "tree" / "scripts", ignore=ignored)
    for name in BUILT_FROM:
        shutil.copy2(ROOT / name, folder / "tree")
    pip = "-m", "pip", "--disable-pip-version-check", "wheel", "--no-deps", "--wheel-dir"
    output(run_python(*pip, folder, folder / "tree", folder=folder))
    (path,) = folder.glob("*.whl")
    return path


@pytest.mark.slow
def test_wheel_holds_every_module_and_data_file(wheel):
    files = {
        path.relative_to(SCRIPTS).as_posix()
        for path in (SCRIPTS / "viscotrain").rglob("*")
        if path.is_file() and path.parent.name != "__pycache__"
    }
    assert {"viscotrain/drawing/interactive.html", "viscotrain/flow/newton.py"} < files
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert packed == files


@pytest.mark.slow
def test_installed_package_uses_tables_and_makes_trains_without_the_solver(wheel, tmp_path):
    """Outside of the checkout, of which it has the table only."""
    pip = "-m", "pip", "--disable-pip-version-check", "install", "--no-deps", "--target"
    output(run_python(*pip, tmp_path / "site", wheel, folder=tmp_path))
    arguments = "-c", USES_A_TABLE, ROOT / FINISHED_TABLE
    done = run_python(*arguments, folder=tmp_path, package=tmp_path / "site")
    assert Path(output(done).strip()).is_relative_to(tmp_path / "site")
