"""Faults, for real: full disks, folders that cannot be written to, damaged files, two runs at once.

Fifty kills of a whole study are `scripts/tools/kill.py`, which takes minutes.
"""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import kill
import numpy as np
import pytest
import xarray as xr
from harness import FINISHED_TABLE, ROOT, SMALL, run_script

from viscotrain import files
from viscotrain.errors import FileError, RunError
from viscotrain.jobs import datasets, stopping
from viscotrain.jobs.running import hold

DATA = xr.Dataset({"x": ("n", np.arange(200_000.0))}, attrs={files.MADE_HERE: "a"})


@pytest.fixture
def small_disk(tmp_path):
    """A folder on a disk of 1 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, check=False, capture_output=True).returncode:
        pytest.skip("disks cannot be mounted here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)  # a failed write holds it


def one_line(error: pytest.ExceptionInfo) -> str:
    text = str(error.value)
    assert "\n" not in text
    return text


# -------------------------------------------------------------------------------------- writing


def test_a_full_disk_is_one_line_and_leaves_the_old_file(small_disk):
    path = small_disk / "a.nc"
    datasets.write(DATA.isel(n=slice(10)), path)
    before = path.read_bytes()
    random = np.random.default_rng(1).random(DATA.sizes["n"])  # which cannot be compressed
    with pytest.raises(FileError) as error:
        datasets.write(DATA.assign(x=("n", random)), path)
    words = one_line(error)
    assert str(path) in words and "No space left" in words and "free some space" in words
    assert path.read_bytes() == before
    assert [each.name for each in small_disk.iterdir()] == ["a.nc"]
    with pytest.raises(FileError, match="No space left"):
        files.write_text("x" * 2_000_000, small_disk / "page.html")
    assert [each.name for each in small_disk.iterdir()] == ["a.nc"]


def test_a_job_on_a_full_disk_ends_with_one_line(small_disk):
    (small_disk / "filled").write_bytes(b"x" * 1_000_000)
    table, output = ROOT / FINISHED_TABLE, small_disk / "velocity_table.nc"
    config = ROOT / "config" / "study_trains.yaml"
    done = run_script("given_table.py", "--configfile", config, table, output)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("error: ") and str(output) in line and "free some space" in line


def test_a_folder_that_cannot_be_written_to_is_one_line(tmp_path, monkeypatch):
    if os.geteuid() != 0:
        (tmp_path / "closed").mkdir(mode=0o500)
        expected = "Permission denied"
    else:  # root may write everywhere but on a disk that is read-only
        folder = tmp_path / "closed"
        folder.mkdir()
        mount = ["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", str(folder)]
        if subprocess.run(mount, check=False, capture_output=True).returncode:
            pytest.skip("disks cannot be mounted here")
        expected = "Read-only file system"
    try:
        with pytest.raises(FileError) as error:
            datasets.write(DATA, tmp_path / "closed" / "new" / "a.nc")
        assert expected in one_line(error) and "--directory" in one_line(error)
        with pytest.raises(RunError, match=expected):
            hold(tmp_path / "closed" / "results")
    finally:
        if os.geteuid() == 0:
            subprocess.run(["umount", str(tmp_path / "closed")], check=True)


def test_no_file_handles_left_is_one_line(tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (64, hard))
    held = []
    try:
        with pytest.raises(FileError, match=r"Too many open files; allow more.*ulimit -n"):
            while len(held) < 100:
                try:
                    held.append(os.open(os.devnull, os.O_RDONLY))
                except OSError:
                    files.write_text("x", tmp_path / "a.txt")
    finally:
        for each in held:
            os.close(each)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert not list(tmp_path.iterdir())


def test_what_is_interrupted_while_writing_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt), files.whole(tmp_path / "a.txt") as part:
        part.write_text("half", encoding="utf-8")
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())


def test_what_a_killed_process_left_behind_goes_with_the_next_one(tmp_path):
    left = tmp_path / ".4242.part.a[1].txt"
    for path in (left, tmp_path / ".4242.part.b.txt"):
        path.write_text("half", encoding="utf-8")
    files.write_text("whole", tmp_path / "a[1].txt")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".4242.part.b.txt", "a[1].txt"]


# -------------------------------------------------------------------------------------- reading


def damaged(path: Path, how: str) -> None:
    """Spoil a file."""
    whole = path.read_bytes()
    if how == "truncated":
        path.write_bytes(whole[: len(whole) // 2])
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "text":
        path.write_text("hello", encoding="utf-8")
    elif how == "foreign":
        path.unlink()
        xr.Dataset({"temperature": ("x", [1.0])}).to_netcdf(path)
    elif how == "flipped":
        middle = bytearray(whole)
        at = len(middle) * 6 // 10  # within the compressed values
        middle[at : at + 64] = bytes(byte ^ 0xFF for byte in middle[at : at + 64])
        path.write_bytes(bytes(middle))


@pytest.mark.parametrize("how", ["truncated", "empty", "text", "foreign", "flipped"])
def test_a_damaged_dataset_is_named_in_one_line(how, tmp_path):
    path = tmp_path / "a.nc"
    random = np.random.default_rng(1).random(20_000)
    datasets.write(DATA.isel(n=slice(20_000)).assign(x=("n", random)), path)
    damaged(path, how)
    with pytest.raises(FileError) as error:
        datasets.read(path)
    assert str(path) in one_line(error) and "delete it and run again" in one_line(error)


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "cpu_seconds\nmany\n", "\x00\xff"])
def test_a_damaged_csv_file_is_named_in_one_line(text, tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(FileError) as error:
        files.read_csv(path, ["cpu_seconds"])
    assert one_line(error) == f"{path} is damaged: delete it and run again"


# --------------------------------------------------------------------------------- the workflow


@pytest.mark.parametrize("how", ["truncated", "foreign"])
def test_a_damaged_simulation_is_found_before_its_table_is_made(how, finished):
    results = finished.folder / "results" / "small"
    part = results / "dns" / "sp1.5_sf1.5.nc"
    damaged(part, how)
    times = part.stat().st_atime, time.time() - 1e6  # older than all that was made of it
    os.utime(part, times)
    (results / "table" / "velocity_table.nc").unlink()
    options = ("--cores", "1", "--configfile", "study.yaml")
    done = finished.snakemake(*options)
    text = done.stdout + done.stderr
    assert done.returncode != 0 and "Traceback" not in text
    (line,) = {line for line in text.splitlines() if "delete it and run again" in line}
    assert "results/small/dns/sp1.5_sf1.5.nc" in line
    part.unlink()
    done = finished.snakemake(*options)
    assert done.returncode == 0, done.stdout + done.stderr


def test_copies_and_touched_files_repeat_nothing(finished, tmp_path):
    nothing = finished.plan("--configfile", "study.yaml")
    assert nothing[0] == {}
    copy = tmp_path / "again"
    shutil.copytree(finished.folder, copy, copy_function=shutil.copy)  # with new times
    finished.folder = copy
    assert finished.plan("--configfile", "study.yaml")[0] == {}
    files_there = [path for path in copy.rglob("*") if path.is_file()]
    for n in np.random.default_rng(1).permutation(len(files_there)):  # a clock that jumps
        at = time.time() + (1000.0 * (n % 7) - 3000)
        os.utime(files_there[n], (at, at))
    assert finished.plan("--configfile", "study.yaml")[0] == {}


@pytest.mark.slow
def test_another_run_makes_the_same_bytes(finished_study, project):
    """In another folder, at another time, on one core in place of two."""
    project.finish_small(cores=1)
    expected, found = kill.content(finished_study), kill.content(project.folder)
    assert found == expected and len(found) > 40


def wait_for(text: str, path: Path):
    """Until a file holds a text."""
    for _ in range(1200):
        if path.exists() and text in path.read_text(encoding="utf-8"):
            return
        time.sleep(0.1)
    raise AssertionError(f"{path}: no {text}")


@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT"])
def test_a_run_that_is_asked_to_stop_says_so_once(name, project):
    """SIGTERM is sent to Snakemake, Ctrl-C by the terminal to all of its processes."""
    terminal, number = project.folder / "terminal.txt", getattr(signal, name)
    command = [sys.executable, "-m", "snakemake", "--cores", "1", "--configfile"]
    with terminal.open("w") as file:
        run = subprocess.Popen(
            [*command, project.configured(SMALL | {"study": "stopped"})],
            cwd=project.folder,
            stdout=file,
            stderr=file,
            env=os.environ | {"PYTHONPATH": str(project.folder / "scripts")},
            start_new_session=True,
        )
    wait_for("spinf_sfinf: solved", terminal)
    (os.kill if name == "SIGTERM" else os.killpg)(run.pid, number)
    assert run.wait(timeout=300) != 0
    text = terminal.read_text(encoding="utf-8")
    own, other = map(stopping.WORDS.get, (stopping.FINISHING, stopping.GIVING_UP))
    if name == "SIGINT":
        own, other = other, own
    assert text.count(own) == 1 and other not in text
    assert "Traceback" not in text and "Error in rule" not in text
    assert "run again to go on from here" in text
    result = project.folder / "results" / "stopped" / "dns" / "spinf_sfinf.nc"
    kept = result.with_name(f"{result.name}.kept")
    # by Ctrl-C the job is given up, unless it has just ended
    assert result.exists() or (name == "SIGINT" and kept.exists())


def test_a_second_run_in_the_same_folder_is_refused(finished):
    results = finished.folder / "results" / "small"
    (results / "units.nc").unlink()
    held = subprocess.Popen(
        ["flock", str(results / ".running"), "sleep", "60"],
        start_new_session=True,
    )
    try:
        time.sleep(1)
        done = finished.snakemake("--cores", "1", "--configfile", "study.yaml")
    finally:
        os.killpg(held.pid, 9)
    assert done.returncode != 0
    assert "another run works in results/small" in done.stdout + done.stderr
    done = finished.snakemake("--cores", "1", "--configfile", "study.yaml")
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_that_is_deleted_is_made_again(finished):
    """No target is hidden behind what is made of it."""
    results = finished.folder / "results" / "small"
    made = [path for path in results.rglob("*") if path.is_file() and path.name[0] != "."]
    gone = [path for path in made if "logs" not in path.parts and path.suffix != ".mp4"]
    assert len(gone) > 40
    for path in gone:
        path.unlink()
    done = finished.snakemake("--dry-run", "--configfile", "study.yaml")
    text = done.stdout + done.stderr
    reasons = "".join(line for line in text.splitlines() if "Missing output files" in line)
    asked = [str(path.relative_to(finished.folder)) for path in gone]
    assert [path for path in asked if path not in reasons] == []


def test_a_geometry_whose_process_dies_is_tried_again_and_the_others_go_on(project):
    study = SMALL | {"study": "dying"}
    config = project.configured(study)
    project.edit(
        "scripts/dns.py",
        '"""Solve, write the dataset and, beside it, the CPU time."""',
        '"""Solve, write the dataset and, beside it, the CPU time."""\n'
        "    import os, signal\n"
        "    if sp == 1.5 and sf == 1.5 and not os.path.exists('died'):\n"
        "        open('died', 'w').close()\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n",
    )
    done = project.snakemake(
        "--cores", "1", "--configfile", config, "--", "results/dying/table/velocity_table.nc"
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (project.folder / "died").exists()
