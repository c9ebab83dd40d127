"""What the tests of several rooms share: folders, studies, and one way to run the project."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import yaml

from viscotrain.config.names import parse_geometry
from viscotrain.config.reading import load_study
from viscotrain.config.study import Study

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "config"
SCRIPTS = ROOT / "scripts"
REFERENCE = ROOT / "tests" / "reference"
VERIFICATION = ROOT / "tests" / "verification"

# ---------------------------------------------------------------------------------------- studies


def written(name: str = "tiny", **sections) -> dict:
    """A shipped config as it stands in its file, with other sections in place of its own."""
    return yaml.safe_load((CONFIG / f"{name}.yaml").read_text(encoding="utf-8")) | sections


def study(name: str = "tiny", **sections) -> Study:
    """A shipped study in which some settings differ: `study("config", dns={"accuracy": 1e-3})`.

    Settings are not checked against each other: a test says only what it is about.
    """
    return _changed(load_study(CONFIG / f"{name}.yaml"), sections)


def _changed(model, changes: dict):
    new = {
        key: _changed(getattr(model, key), value) if isinstance(value, dict) else value
        for key, value in changes.items()
    }
    return model.model_copy(update=new)


# Two distances at one Deborah number: the least that has every kind of job.
SMALL = written(
    study="small",
    deborah={"values": [1], "definition": "longest_mode"},
    table={
        "sp": [1.5, float("inf")],
        "sf": [1.5, float("inf")],
        "pair": [],
        "check": 0,
        "max_holes": 0,
    },
    figures={"field": {"sp": 1.5, "sf": 1.5, "deborah": [1]}},
)

# ------------------------------------------------------------------------------------ subprocesses


def run_python(
    *arguments, folder: Path = ROOT, package: Path = SCRIPTS, **variables: str
) -> subprocess.CompletedProcess[str]:
    """Run Python in a folder, with the package that is in another and one thread."""
    threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=folder,
        env=os.environ | threads | {"PYTHONPATH": str(package)} | variables,
        capture_output=True,
        text=True,
        timeout=1200,
        check=False,
    )


def run_script(name: str, *arguments, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Run a script of the project from its command line."""
    return run_python(SCRIPTS / name, *arguments, folder=folder)


def output(done: subprocess.CompletedProcess[str]) -> str:
    """What a process printed that must have succeeded."""
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


# ---------------------------------------------------------------------------------------- projects

FINISHED_TABLE = Path("docs/study/velocity_table.nc")
PARTS = ("workflow", "scripts", "config", "profiles", "envs")
DNS_JOB = re.compile(r"Job \d+: Simulating (sp\S+_sf.*)")
JOB_COUNT = re.compile(r"^(\w+)\s+(\d+)$", re.MULTILINE)


class Project:
    """A copy of the project's files, in which Snakemake and the scripts run."""

    def __init__(self, folder: Path):
        self.folder = folder

    @classmethod
    def copy(cls, folder: Path) -> "Project":
        ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
        for part in PARTS:
            shutil.copytree(ROOT / part, folder / part, ignore=ignored)
        shutil.copy2(ROOT / "Snakefile", folder)
        (folder / FINISHED_TABLE).parent.mkdir(parents=True)
        shutil.copy2(ROOT / FINISHED_TABLE, folder / FINISHED_TABLE)
        return cls(folder)

    def configured(self, study: dict) -> str:
        """Write a config and return its name."""
        (self.folder / "study.yaml").write_text(yaml.safe_dump(study), encoding="utf-8")
        return "study.yaml"

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run Python with the package of this copy."""
        return run_python(*arguments, folder=self.folder, package=self.folder / "scripts")

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        return self.run("-m", "snakemake", *arguments)

    def finish_small(self, cores: int) -> str:
        """Run the small study to its end, with empty figures to save time; what was printed."""
        stub = "from pathlib import Path\nfor path in snakemake.output:\n    Path(path).touch()\n"
        (self.folder / "scripts" / "figures.py").write_text(stub, encoding="utf-8")
        done = self.snakemake("--cores", str(cores), "--configfile", self.configured(SMALL))
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    def plan(self, *arguments: str) -> tuple[dict[str, int], set[tuple[str, str]]]:
        """Dry run: number of jobs per rule, and the geometries (sp, sf) that are simulated.

        Of the dns stage the number of geometries, not of jobs, each of which has a rule.
        """
        done = self.snakemake("--dry-run", *arguments)
        text = done.stdout + done.stderr
        assert done.returncode == 0, text
        counts = {rule: int(count) for rule, count in JOB_COUNT.findall(text)}
        counts.pop("total", None)
        jobs = [counts.pop(rule) for rule in list(counts) if rule.startswith("dns_")]
        groups = DNS_JOB.findall(text)
        assert len(groups) == sum(jobs)
        geometries = [parse_geometry(name) for group in groups for name in group.split(", ")]
        assert len(geometries) == len(set(geometries))
        return counts | ({"dns": len(geometries)} if geometries else {}), set(geometries)

    def edit(self, name: str, old: str, new: str):
        """Replace a piece of text in a file of the copy, which must be there."""
        path = self.folder / name
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
