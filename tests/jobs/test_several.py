"""A job of several geometries: what is solved, what is kept and what a crash leaves."""

import os
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest

from viscotrain.jobs import several

NAMES = ["spinf_sfinf", "sp1.5_sfinf", "sp1.02_sf1.5"]


@pytest.fixture
def job(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("dns/timing", "logs"):
        Path(folder).mkdir(parents=True)
    return SimpleNamespace(
        input={},
        params={"study": "tiny", "settings": "of all"},
        output={
            "result": [f"dns/{name}.nc" for name in NAMES],
            "timing": [f"dns/timing/{name}.csv" for name in NAMES],
        },
        log=["logs/job_1.log"],
    )


def solve(part):
    """In place of a simulation: writes its result, then its time."""
    print("solving")
    Path(part.output["result"]).write_text(f"{part.wildcards} now")
    Path(part.output["timing"]).write_text("1 s")


def run(job, one=solve):
    several.run(job, one, lambda part, path: path.read_text().endswith("now"))


def clear_logs():
    for log in Path("logs").iterdir():
        log.unlink()


def there(pattern) -> set[str]:
    return {path.name for path in Path("dns").glob(pattern)}


def test_every_geometry_has_its_distances_outputs_and_log(job):
    run(job)
    assert there("*.nc") == {f"{name}.nc" for name in NAMES}
    assert not there("**/*.kept")
    assert Path("dns/sp1.02_sf1.5.nc").read_text() == "{'sp': '1.02', 'sf': '1.5'} now"
    assert [Path(f"logs/{name}.log").read_text() for name in NAMES] == 3 * ["solving\n"]


def test_settings_are_those_of_all_or_one_for_each(job):
    def shown(part):
        print(part.params)
        solve(part)

    asked = []
    run(job, shown)
    assert Path(f"logs/{NAMES[2]}.log").read_text() == f"{job.params}\nsolving\n"
    spheres = ["spinf_sfinf_d0.9", "spinf_sfinf_d1.1"]
    job.output = {"result": [f"dns/{name}.nc" for name in spheres]}
    job.params["settings"] = ["smaller", "larger"]

    def alone(part):
        Path(part.output["result"]).write_text(f"{part.wildcards} {part.params['settings']}")

    several.run(job, alone, lambda part, path: asked.append(part.params["settings"]))
    made = [Path(path).read_text() for path in job.output["result"]]
    assert made == [f"{{'sp': 'inf', 'sf': 'inf'}} {each}" for each in ("smaller", "larger")]
    several.run(job, alone, lambda part, path: asked.append(part.params["settings"]) or True)
    assert asked == ["smaller", "larger"]


@pytest.mark.parametrize("way", ["raises", "dies"])
def test_one_that_fails_leaves_the_others_which_are_taken_up(job, way, capfd):
    def ill(part):
        if part.wildcards["sp"] == "1.5" and way == "raises":
            raise RuntimeError("no mesh")
        if part.wildcards["sp"] == "1.5":
            Path(part.output["result"]).write_text("half a result, now")
            os.kill(os.getpid(), signal.SIGKILL)
        solve(part)

    with pytest.raises(SystemExit) as end:
        run(job, ill)
    assert end.value.code == 1
    assert there("*.nc") == set()  # Snakemake would remove them
    assert {"spinf_sfinf.nc.kept", "sp1.02_sf1.5.nc.kept"} <= there("*.kept")
    shown = capfd.readouterr()
    told = shown.err
    if way == "raises":
        assert told == "sp1.5_sfinf: failed, see logs/sp1.5_sfinf.log\n"
        assert "RuntimeError: no mesh" in Path("logs/sp1.5_sfinf.log").read_text()
        assert "RuntimeError: no mesh" in shown.out  # the log of the job, which Snakemake shows
    else:
        assert told.startswith("sp1.5_sfinf: ended by SIGKILL, for want of memory perhaps")
        assert told.count("\n") == 1

    clear_logs()
    run(job)
    assert there("*.nc") == {f"{name}.nc" for name in NAMES}
    assert {path.name for path in Path("logs").iterdir()} == {"sp1.5_sfinf.log"}


def test_what_is_there_stays_and_what_is_not_current_is_made_again(job):
    run(job)
    Path("dns/spinf_sfinf.nc").write_text("of other settings")
    Path("dns/timing/sp1.5_sfinf.csv").unlink()
    Path("dns/sp1.02_sf1.5.nc.kept").write_text("not looked at, now")
    clear_logs()
    run(job)
    assert {path.stem for path in Path("logs").iterdir()} == {"spinf_sfinf", "sp1.5_sfinf"}
    assert Path("dns/spinf_sfinf.nc").read_text().endswith("now")


def test_a_folder_takes_the_place_of_an_older_one(job):
    job.output["fields"] = [f"dns/{name}" for name in NAMES]

    def with_fields(part):
        solve(part)
        folder = Path(part.output["fields"])
        folder.mkdir()
        (folder / "new.vtu").touch()

    Path("dns/spinf_sfinf").mkdir()
    Path("dns/spinf_sfinf/old.vtu").touch()
    run(job, with_fields)
    assert [path.name for path in Path("dns/spinf_sfinf").iterdir()] == ["new.vtu"]


def test_one_geometry_finds_nothing_that_another_left_in_memory(job):
    left = []

    def remembering(part):
        assert left == []
        left.append(part)
        solve(part)

    run(job, remembering)
