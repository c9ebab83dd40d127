"""Snakemake's report: what it holds, and that a browser shows it."""

import shutil
import subprocess
from pathlib import Path

import pytest
from harness import output

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")


def opened(path: Path) -> tuple[str, list[str]]:
    """The page after its scripts have run, without any network, and what they complained about."""
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr"]
    command += ["--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=8000", "--dump-dom"]
    done = subprocess.run(
        [*command, path.resolve().as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return done.stdout, console


@needs_chromium
@pytest.mark.slow
def test_report_runs_in_a_browser(project, tmp_path):
    """Of the figures that need no simulation: captions, labels and pictures, without a network."""
    options = ["--cores", "1", "--configfile", "config/tiny.yaml", "--workflow-profile", "none"]
    pictures = [f"results/tiny/figures/{name}.png" for name in ("schematic", "rheology")]
    for more in ([], ["--report", "report.html"]):
        output(project.snakemake(*options, *more, "--", *pictures))
    shown, console = opened(tmp_path / "report.html")
    assert [line for line in console if "tailwindcss" not in line] == []
    assert "Snakemake" in shown
    assert "Study" in shown
    assert "What a rheometer would measure" in (tmp_path / "report.html").read_text("utf-8")
