"""The package that is built from the tree: whole, and enough by itself to read a table."""

import shutil
import zipfile
from pathlib import Path

import pytest
from harness import ROOT, SCRIPTS, output, run_python

BUILT_FROM = ("pyproject.toml", "README.md", "LICENSE")
READS_A_TABLE = (
    "from viscotrain import VelocityTable; import sys; "
    "assert not any(m.startswith('ngsolve') for m in sys.modules); "
    "print(sys.modules['viscotrain'].__file__)"
)


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
def test_installed_package_reads_tables_without_the_solver(wheel, tmp_path):
    pip = "-m", "pip", "--disable-pip-version-check", "install", "--no-deps", "--target"
    output(run_python(*pip, tmp_path / "site", wheel, folder=tmp_path))
    done = run_python("-c", READS_A_TABLE, folder=tmp_path, package=tmp_path / "site")
    assert Path(output(done).strip()).is_relative_to(tmp_path / "site")
