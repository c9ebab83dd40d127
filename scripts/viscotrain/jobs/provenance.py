"""Where a dataset comes from: its settings, the digest of the code, versions, the git commit."""

import functools
import importlib.metadata
import subprocess
from pathlib import Path

import xarray as xr

from viscotrain.config.settings import Settings

PACKAGE = Path(__file__).parents[1]
SOFTWARE = ("viscotrain", "ngsolve", "netgen-mesher", "numpy", "scipy", "xarray")


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
        answer = subprocess.run(  # noqa: S603, the words of the command are those above
            command, capture_output=True, text=True, timeout=20, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return answer.stdout.strip() if answer.returncode == 0 else "unknown"


def attributes(title: str, settings: Settings | None = None, code: str = "") -> dict[str, str]:
    """Global attributes of a dataset (CF conventions); no wall clock, so bytes can be compared.

    Args:
        title: What the dataset holds.
        settings: Of its stage.
        code: Digest of the script that makes it.
    """
    return {
        "Conventions": "CF-1.11",
        "title": title,
        "source": f"viscotrain, {software_versions()}",
        "history": f"made by viscotrain at commit {git_commit()}",
        "references": "equations and their sources: module headers of viscotrain",
        "git_commit": git_commit(),
        "software_versions": software_versions(),
        "code_digest": code,
        "settings": settings.stated().text() if settings else "",
    }


def was_made_with(attributes: dict[str, str], settings: Settings, code: str) -> bool:
    """Whether a file with these attributes has these settings and is of this code."""
    own = attributes.get("settings"), attributes.get("code_digest")
    return own == (settings.stated().text(), code)


def made_with(path: Path, settings: Settings, code: str) -> bool:
    """Whether a file is there and was made with these settings and this code."""
    if not path.exists():
        return False
    try:
        with xr.open_dataset(path) as dataset:
            return was_made_with(dataset.attrs, settings, code)
    except (OSError, RuntimeError, ValueError, AttributeError):  # damaged, or not netCDF
        return False
