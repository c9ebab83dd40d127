"""Measured spacings: what a file may hold, and how far they are from those of trains."""

import math

import numpy as np
import pytest
import xarray as xr
from harness import CONFIG, output, run_script
from scipy.special import kolmogorov
from synthetic import SINGLE, at_deborah, superposed, triplet

from viscotrain.config.reading import load_study, measured_file
from viscotrain.errors import ConfigError, DataError
from viscotrain.files import MADE_HERE
from viscotrain.fluid.csv_files import MOST_PROBLEMS
from viscotrain.jobs import datasets
from viscotrain.trains import measured, spacings_file
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.spacings_file import Spacing

KNOWN = {"station": (0.0, 400.0), "deborah": (1.0, 5.0), "volume_fraction": (0.004, 0.1 + 0.2)}


def written(tmp_path, text):
    path = tmp_path / "spacings.csv"
    path.write_text(text, encoding="utf-8")
    return path


def problems_of(tmp_path, text):
    with pytest.raises(DataError) as error:
        spacings_file.read(written(tmp_path, text), KNOWN)
    return str(error.value).replace(f"{tmp_path}/", "").splitlines()


# -------------------------------------------------------------------------------------- the file


def test_lines_in_any_order_with_or_without_conditions(tmp_path):
    text = "# seen on Monday\nspacing,station\n3.5,400\n\n2.5,0\n"
    assert spacings_file.read(written(tmp_path, text), KNOWN) == [
        Spacing(400.0, 3.5, None, None),
        Spacing(0.0, 2.5, None, None),
    ]
    text = "station,spacing,deborah,volume_fraction\n0,2,5,0.3\n0,2,,0.004\n400,3,1,\n"
    assert spacings_file.read(written(tmp_path, text), KNOWN) == [
        Spacing(0.0, 2.0, 5.0, 0.1 + 0.2),  # as the study writes it
        Spacing(0.0, 2.0, None, 0.004),
        Spacing(400.0, 3.0, 1.0, None),
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("0,3\n", "line 1: no column names; allowed: station, spacing, deborah, volume_fraction"),
        ("station,gap\n0,3\n", "line 1: unknown column 'gap'; allowed: station, spacing"),
        ("station,spacin\n0,3\n", "line 1: unknown column 'spacin'; did you mean spacing?"),
        ("station;spacing\n0;3\n", "line 1: columns separated by semicolons; allowed: by commas"),
        ("station,deborah\n0,5\n", "line 1: no column spacing; allowed: station, spacing"),
        ("station,spacing\n", "spacings.csv: no measured numbers"),
        ("station,spacing\n0\n", "line 2: found 1 cells; allowed: 2, as named"),
        ("station,spacing\n0,\n", "line 2: spacing: found nothing; allowed: a number"),
        ("station,spacing\n0,wide\n", "line 2: spacing: found 'wide'; allowed: a finite number"),
        ("station,spacing\n0,=A1*2\n", "line 2: spacing: found '=A1*2'; allowed: a finite number"),
        ('station,spacing\n0,"3,5"\n', "line 2: spacing: found '3,5' (write 3.5); allowed"),
        ("station;spacing\n0;3,5\n", "line 1: columns separated by semicolons; allowed"),
        ("station,spacing\n0,-3\n", "line 2: spacing: found -3; allowed: above 0"),
        ("station,spacing\n-1,3\n", "line 2: station: found -1; allowed: 0 to 1e+06 D"),
        (
            "station,spacing\n0,6e-5\n",
            "found 6e-05; allowed: 0.5 to 1000 d. Is the unit d?",
        ),
        (
            "station,spacing\n0,3\n# more\n40,3\n",
            "line 4: station: found 40; allowed: one of the study's trains, 0, 400",
        ),
        (
            "station,spacing,deborah\n0,3,2\n",
            "line 2: deborah: found 2; allowed: one of the study's trains, 1, 5",
        ),
    ],
)
def test_problems_are_named_with_their_line(tmp_path, text, problem):
    lines = problems_of(tmp_path, text)
    assert lines[0] == "measured spacings: 1 problem"
    assert problem in lines[1]


def test_all_problems_come_in_one_message(tmp_path):
    lines = problems_of(tmp_path, "station,spacing\n0,x\n7,3\n0,-1\n")
    assert lines[0] == "measured spacings: 3 problems"
    assert [line.split(": ")[0].split(", ")[1] for line in lines[1:]] == [
        "line 2",
        "line 3",
        "line 4",
    ]
    many = "station,spacing\n" + "7,3\n" * (MOST_PROBLEMS + 5)
    assert problems_of(tmp_path, many)[-1] == "  ... and 5 more"


def test_files_of_spreadsheets_are_read_and_huge_ones_are_not(tmp_path):
    path = tmp_path / "spacings.csv"
    path.write_bytes(b"\xef\xbb\xbfstation,spacing\r\n0,3\r\n")
    assert spacings_file.read(path, KNOWN) == [Spacing(0.0, 3.0, None, None)]
    with path.open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(DataError, match="found 100 MB; allowed: at most 1 MB"):
        spacings_file.read(path, KNOWN)


def test_the_shipped_example_can_be_read_and_says_that_it_is_synthetic():
    path = CONFIG / "synthetic_spacings.csv"
    rows = spacings_file.read(path, {"station": (0, 200, 400, 600, 800)})
    assert len(rows) == 300 and {row.station for row in rows} == {400, 800}
    assert path.read_text(encoding="utf-8").startswith("# Synthetic, not measured")


# --------------------------------------------------------------------------------- the comparison


def simulated(spacing):
    """Spacings (repeat, station, passage) as the trains stage writes them."""
    return xr.Dataset(
        {"spacing": (("repeat", "station", "passage"), np.asarray(spacing, dtype=float))},
        coords={
            "station": [0.0, 400.0][: np.shape(spacing)[1]],
            "spacing_bin": 1.125 + 0.25 * np.arange(18),
        },
    )


def rows(station, *spacings):
    return [Spacing(station, s, None, None) for s in spacings]


def test_distance_by_hand():
    """Of 2, 3, 4, 5 and 2.5, 6: half as many are below 5.5 as are, 1/2 apart."""
    trains = simulated([[[2.0, 3.0], [9.0, 9.0]], [[4.0, 5.0], [9.0, 9.0]]])
    found = measured.compare(trains, rows(0.0, 2.5, 6.0))
    assert found["ks_distance"].values == pytest.approx([0.5, math.nan], nan_ok=True)
    # of the 15 ways to mix four (n) and two (m), all but n m n n m n are so far apart
    assert float(found["ks_p_value"][0]) == pytest.approx(14 / 15)
    assert found["measured_count"].values.tolist() == [2, 0]
    assert float(found["measured_mean_spacing"][0]) == pytest.approx(4.25)
    assert float(found["measured_spacing_variation"][0]) == pytest.approx(1.75 / 4.25)


def test_stations_are_not_mixed_up():
    near, far = np.linspace(1.1, 3.0, 40), np.linspace(3.1, 5.0, 40)
    trains = simulated([[near, far]])
    right = measured.compare(trains, rows(0.0, *near[::2]) + rows(400.0, *far[::2]))
    wrong = measured.compare(trains, rows(0.0, *far[::2]) + rows(400.0, *near[::2]))
    assert right["ks_distance"].max() < 0.06
    assert wrong["ks_distance"].values == pytest.approx([1, 1])
    assert wrong["ks_p_value"].max() < 1e-6
    assert right["measured_station"].values.tolist() == [0.0] * 20 + [400.0] * 20


def test_many_spacings_agree_with_their_own_distribution():
    """By the definition, on the ordered sample, and the limit of large samples for p."""
    rng = np.random.default_rng(5)
    many, few = 1 + rng.exponential(size=(20, 1, 1000)), 1.1 + rng.exponential(size=200)
    found = measured.compare(simulated(many), rows(0.0, *few))
    below = np.array([(many <= s).mean() - (few <= s).mean() for s in np.append(many, few)])
    assert float(found["ks_distance"][0]) == pytest.approx(np.abs(below).max(), abs=1e-12)
    size = math.sqrt(20000 * 200 / 20200)
    limit = kolmogorov(size * float(found["ks_distance"][0]))
    assert float(found["ks_p_value"][0]) == pytest.approx(limit, rel=0.2)


def test_densities_are_those_of_coarse_bins():
    found = measured.compare(simulated([[[2.0, 3.0]]]), rows(0.0, 0.98, 1.5, 1.99, 4.2, 99.0))
    assert found["measured_bin"].values.tolist() == [1.5, 2.5, 3.5, 4.5, 5.5]
    assert found["measured_density"].values[0] == pytest.approx([0.6, 0, 0, 0.2, 0])
    error = [math.sqrt(3) / 5, 0, 0, 0.2, 0]
    assert found["measured_density_error"].values[0] == pytest.approx(error)


def test_spacings_are_compared_with_the_trains_they_are_of():
    of_all, of_one = Spacing(0.0, 3.0, None, None), Spacing(0.0, 4.0, 5.0, 0.004)
    pick = measured.of_condition
    assert pick([of_all, of_one], 5.0, 0.004) == [of_all, of_one]
    assert pick([of_all, of_one], 1.0, 0.004) == [of_all]
    assert pick([of_all, of_one], 5.0, 0.006) == [of_all]


def trains(repeats=12):
    """Spheres that feel each other twenty times as much as they would."""
    result = run_repeats(
        triplet(law=lambda sp, sf: superposed(sp, sf, scale=20)),
        confinement=0.2,
        volume_fraction=0.01,
        centreline_velocity=SINGLE,
        length=40.0,
        stations=[0.0, 40.0],
        passages=80,
        repeats=repeats,
        seed=1,
    )
    return at_deborah(result, 1.0)


def test_runs_of_a_train_are_seldom_far_from_the_others():
    """P below 0.05 in about one of twenty, though neighbours are not quite independent."""
    own = trains()
    p = []
    for n in range(12):
        others = own.isel(repeat=[k for k in range(12) if k != n])
        spacing = own["spacing"].values[n]
        seen = rows(0.0, *spacing[0]) + rows(40.0, *spacing[1])
        p.append(measured.compare(others, seen)["ks_p_value"].values)
    assert np.mean(np.array(p) < 0.05) < 0.15
    assert 0.25 < np.median(p) < 0.85


def test_the_headline_has_a_line_for_each_station_where_something_is_measured():
    found = measured.compare(simulated([[[2.0, 3.0], [4.0, 5.0]]]), rows(400.0, 4.0, 5.0))
    (line,) = measured.headline(found)
    assert line.startswith("at z = 400 D: 2 measured spacings, mean 4.50 d, CV 0.111;")
    assert "distance 0.000, p = 1 (if independent)" in line
    nothing = measured.compare(simulated([[[2.0, 3.0]]]), [])
    assert measured.headline(nothing) == ["nothing measured at this condition"]
    assert measured.probability(3e-7) == "p < 0.0001"


def test_the_script_compares_the_file_with_its_trains(tmp_path):
    text = (CONFIG / "tiny.yaml").read_text(encoding="utf-8")
    config = tmp_path / "study.yaml"
    config.write_text(text.replace("stations: [0, 10, 20] ", "stations: [0, 40] "), "utf-8")
    config.write_text(config.read_text("utf-8").replace("length: 20}", "length: 40}"), "utf-8")
    source = written(tmp_path, "station,spacing,volume_fraction\n40,2.5,0.01\n40,3.5,\n")
    train, result = tmp_path / "train.nc", tmp_path / "measured.nc"
    datasets.write(trains(repeats=2).assign_attrs({MADE_HERE: "0123"}), train)
    done = run_script("measured.py", "--configfile", config, source, train, result)
    assert "at z = 40 D: 2 measured spacings, mean 3.00 d" in output(done)
    assert xr.load_dataset(result)["measured_count"].values.tolist() == [0, 2]


def test_a_config_with_a_wrong_file_is_refused_by_line(tmp_path):
    config = tmp_path / "study.yaml"
    text = (CONFIG / "tiny.yaml").read_text(encoding="utf-8")
    config.write_text(text.replace("\ntrains:\n", "\ntrains:\n  measured: spacings.csv\n"), "utf-8")
    study = load_study(config)
    with pytest.raises(ConfigError, match=r"trains\.measured: there is no file .*spacings\.csv"):
        measured_file(study, config)
    written(tmp_path, "station,spacing\n15,3\n")
    with pytest.raises(ConfigError, match=r"line 2: station: found 15; allowed: .*0, 10, 20"):
        measured_file(study, config)
    path = written(tmp_path, "station,spacing\n10,3\n")
    assert measured_file(study, config).endswith(path.name)
