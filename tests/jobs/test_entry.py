"""One declaration, both ways to run: as a job of Snakemake and from the command line."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from viscotrain.config import stages
from viscotrain.config.reading import load_study
from viscotrain.jobs import entry
from viscotrain.jobs.digests import digest

ROOT = Path(__file__).parents[2]
TINY = load_study(ROOT / "config" / "tiny.yaml")
BY_HAND = sorted(path.stem for path in (ROOT / "scripts").glob("*.py"))


class Named(dict):
    """As Snakemake's lists with names."""

    def __getattr__(self, name):
        return self[name]


def of_workflow(tmp_path, **parts):
    params = {"study": "tiny", "code": "0123", "settings": stages.dns(TINY, 1.5, 1.5).stated()}
    empty = {name: Named() for name in ("input", "output", "wildcards")}
    given = {name: Named(values) for name, values in parts.items()}
    params = Named(params | given.pop("params", {}))
    log = [str(tmp_path / "job.log")]
    return SimpleNamespace(**empty | given, params=params, log=log)


SCRIPT = """
def main(
    job: Job,
    sp: SP,
    sf: SF,
    results: Annotated[Sequence[Path], taken("files")],
    result: Result,
    timing: Timing = None,
):
    found.update(locals())
"""


def run_with(found: dict, namespace: dict):
    """Run a script, as it were, whose names are given, and find what its main was given."""
    script = vars(entry) | namespace | {"found": found}
    exec(SCRIPT, script)
    entry.run(script["main"], settings=stages.dns)


def test_a_job_gets_wildcards_files_and_settings(tmp_path):
    found = {}
    job = of_workflow(
        tmp_path,
        wildcards={"sp": "1.5", "sf": "inf"},
        input={"results": "one.nc"},
        output={"result": "a/b.nc"},
    )
    run_with(found, {"snakemake": job, "__name__": "__main__"})
    assert (found["sp"], found["sf"]) == (1.5, float("inf"))
    assert found["results"] == [Path("one.nc")]
    assert (found["result"], found["timing"]) == (Path("a/b.nc"), None)
    own = found["job"]
    assert own.settings == stages.dns(TINY, 1.5, 1.5)
    assert (own.study, own.code, own.by_hand) == ("tiny", "0123", False)
    assert own.attributes("x")["settings"] == own.settings.stated().text()
    assert own.attributes("x")["title"] == "x of study tiny"


def test_the_command_line_gets_the_same(tmp_path, monkeypatch):
    found = {}
    script = ROOT / "scripts" / "dns.py"
    line = ["--configfile", str(ROOT / "config/tiny.yaml"), "--sp", "1.5", "--sf", "1.5"]
    monkeypatch.setattr(sys, "argv", ["dns.py", *line, "one.nc", "out.nc"])
    namespace = {"__name__": "__main__", "__file__": str(script), "__doc__": "x"}
    run_with(found, namespace)
    own = found["job"]
    assert own.settings == stages.dns(TINY, 1.5, 1.5)
    assert (own.study, own.code, own.by_hand) == ("tiny", digest("dns"), True)
    assert (found["results"], found["result"]) == ([Path("one.nc")], Path("out.nc"))


def test_what_a_rule_does_not_give_is_left_out_or_named(tmp_path):
    found = {}
    given = {"wildcards": {"sp": "1.5", "sf": "inf"}, "input": {"results": ["1.nc", "2.nc"]}}
    job = of_workflow(tmp_path, **given, output={"result": "a.nc", "timing": "a.csv"})
    run_with(found, {"snakemake": job, "__name__": "__main__"})
    assert found["results"] == [Path("1.nc"), Path("2.nc")]
    assert found["timing"] == Path("a.csv")
    job = of_workflow(tmp_path, **given)
    with pytest.raises(KeyError, match=r"the rule has no output\.result"):
        run_with(found, {"snakemake": job, "__name__": "__main__"})


def test_an_imported_script_does_nothing():
    found = {}
    run_with(found, {"__name__": "dns"})
    assert found == {}


HELP = """
import contextlib, io, runpy, sys
for path in sys.argv[1:]:
    more = ["convergence"] if path.endswith("verification.py") else []
    sys.argv = [path, *more, "--help"]
    shown = io.StringIO()
    try:
        with contextlib.redirect_stdout(shown):
            runpy.run_path(path, run_name="__main__")
    except SystemExit as end:
        print(path, end.code, "usage:" in shown.getvalue(), f"scripts/{path}" in shown.getvalue())
"""


def test_every_script_says_what_it_takes():
    """All in one process, which imports what they share once."""
    done = subprocess.run(
        [sys.executable, "-c", HELP, *(f"{name}.py" for name in BY_HAND)],
        cwd=ROOT / "scripts",
        env=os.environ | {"PYTHONPATH": str(ROOT / "scripts")},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    told = [f"{name}.py 0 True {name != 'verification'}" for name in BY_HAND]
    assert done.stdout.splitlines() == told


def by_hand(folder: Path, *arguments: str):
    """Run a script on the tiny study in a folder."""
    script, *rest = arguments
    line = [sys.executable, ROOT / "scripts" / script, *rest]
    done = subprocess.run(
        [*line, "--configfile", ROOT / "config" / "tiny.yaml"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT / "scripts")},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_transient_and_its_comparison_by_hand(tmp_path):
    """Options are not mixed up: sp, sf and De of the files are those asked for."""
    options = ["--sp", "inf", "--sf", "1.5", "--deborah", "0.5"]
    by_hand(tmp_path, "transient.py", *options, "pair.nc", "pair.csv")
    pair = xr.load_dataset(tmp_path / "pair.nc")
    assert [float(pair[name]) for name in ("sp", "sf", "deborah")] == [np.inf, 1.5, 0.5]
    assert pair["sphere"].values.tolist() == ["middle", "leading"]
    assert float(pair["time"][-1]) == pytest.approx(TINY.dns.transient.duration * 0.5)
    assert pair.attrs["settings"] == stages.transient(TINY, 0.5).stated().text()
    assert pd.read_csv(tmp_path / "pair.csv")["cpu_seconds"].item() > 0


@pytest.mark.slow
def test_verification_by_hand(tmp_path):
    options = ["--kind", "order", "--sp", "inf", "--sf", "1.5"]
    by_hand(tmp_path, "verification.py", "convergence", *options, "order.csv")
    rows = pd.read_csv(tmp_path / "order.csv")
    found = rows[rows["default"]].set_index("deborah")["value"]
    for De, own in rows.groupby("deborah"):
        assert own["value"].tolist() == [found[De] - 1, found[De], found[De] + 1]
    assert set(rows["sp"]) == {np.inf} and set(rows["sf"]) == {1.5}
    by_hand(tmp_path, "closure_gap.py", "--gap", "0.5", "gap.csv")
    rows = pd.read_csv(tmp_path / "gap.csv")
    assert set(rows["gap"]) == {0.5} and set(rows["deborah"]) == {1.0}
    assert rows["number"].tolist() == [1, 2, 3]
