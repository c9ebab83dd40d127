"""Fit of the fluid: known fluids are found again, bad or vague data refused with reasons."""

import dataclasses
import math
import re
import time

import numpy as np
import pytest
import xarray as xr
import yaml
from harness import CONFIG, output, run_script, study, written
from matplotlib.text import Text
from rheometer import (
    HYALURONIC_ACID,
    NOISE,
    OLDROYD_B,
    ONE_MODE,
    csv_text,
    deviations,
    measured,
    parameters,
    rates,
)

from viscotrain.config import stages
from viscotrain.config.models import FluidConfig
from viscotrain.config.reading import (
    data_files,
    fitted_fluid_file,
    parse_study,
    with_fitted_fluid,
    with_fluid,
)
from viscotrain.drawing.rheology_figure import rheology
from viscotrain.errors import ConfigError, DataError, FluidError
from viscotrain.fluid import csv_files, fit_report, measurements
from viscotrain.fluid.fit_parameters import Known
from viscotrain.fluid.fit_problem import model
from viscotrain.fluid.fluid_fit import fit
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid, Mode
from viscotrain.fluid.wall import wall_shear_rate
from viscotrain.jobs import datasets, drawings

# ------------------------------------------------------------------------------------ recovery


@pytest.mark.parametrize("seed", range(3))
def test_table_i_is_found_again_in_noise(seed, tmp_path):
    """Two modes are chosen; viscosities and times within 5 %, mobilities within 15 %.

    Measured like a careful rheologist does, at 20 points per decade: the information in fewer
    points does not reach 15 % of the mobility of the slow mode.
    """
    files = measured(tmp_path, per_decade=20, noise=NOISE, seed=seed)
    found = fit(measurements.read(files)).chosen
    assert len(found.fluid.modes) == 2
    error = np.abs(parameters(found.fluid) / parameters(HYALURONIC_ACID) - 1)
    mobility = [name.endswith("mobility") for name in found.names]
    assert error[np.logical_not(mobility)].max() < 0.05
    assert error[mobility].max() < 0.15
    assert found.misfit == pytest.approx(NOISE, rel=0.2)


@pytest.mark.parametrize("fluid", [HYALURONIC_ACID, ONE_MODE, OLDROYD_B, Fluid(0.3)])
def test_exact_data_give_the_fluid(fluid, tmp_path):
    result = fit(measurements.read(measured(tmp_path, fluid)))
    found = result.chosen
    assert len(found.fluid.modes) == len(fluid.modes)
    # the files have ten digits; a mobility at its limit 0 is approached from inside
    assert parameters(found.fluid) == pytest.approx(parameters(fluid), rel=1e-5, abs=1e-4)
    assert found.misfit < 1e-4
    assert np.all(found.uncertainties > 0)  # exact data are no certainty
    counts = [len(candidate.fluid.modes) for candidate in result.candidates]
    # one more than there are, with which the criterion rises
    assert counts == list(range(1 if fluid.modes else 0, len(fluid.modes) + 2))


@pytest.mark.slow
def test_uncertainties_are_those_of_repeated_measurements(tmp_path):
    """Mean of ((found - true)/uncertainty)^2 is 1; a factor two would make it 1/4 or 4.

    The seven deviations of a fit are correlated: with 16 fits the mean scatters by about 0.2.
    """
    scores = []
    for seed in range(16):
        files = measured(tmp_path, per_decade=10, noise=NOISE, seed=seed)
        found = fit(measurements.read(files), modes=2).chosen
        scores.append(np.mean(deviations(found, HYALURONIC_ACID) ** 2))
    assert 0.5 < np.mean(scores) < 1.8


def test_uncertainty_of_a_mean_by_hand(tmp_path):
    """A solvent in steady shear: the geometric mean, with the standard error of a mean."""
    path = tmp_path / "shear.csv"
    eta = np.array([0.9, 1.1, 1.0, 1.2, 0.8, 1.05])
    rows = [f"{rate},{value}" for rate, value in zip(rates(1, 1, 1e5), eta, strict=True)]
    path.write_text("shear_rate,viscosity\n" + "\n".join(rows), encoding="utf-8")
    found = fit(measurements.read([path]), modes=0).chosen
    assert found.fluid.solvent_viscosity == pytest.approx(np.exp(np.log(eta).mean()), rel=1e-6)
    assert found.uncertainties == pytest.approx([np.log(eta).std(ddof=1) / 6**0.5], rel=1e-5)
    squares = np.sum((np.log(eta) - np.log(eta).mean()) ** 2)
    assert found.criterion == pytest.approx(6 * math.log(squares / 6) + math.log(6), rel=1e-6)


def test_known_solvent_is_not_fitted(tmp_path):
    """Where rates do not reach the solvent, it has to be known."""
    spans = {"frequency": (0.1, 100.0), "rate": (0.1, 100.0)}
    fluid = Fluid(0.001, ONE_MODE.modes)
    data = measurements.read(measured(tmp_path, fluid, noise=NOISE, **spans))
    with pytest.raises(
        DataError, match=r"(?s)1 mode:\n  solvent_viscosity: .*help: the viscosity of the solvent"
    ):
        fit(data)
    found = fit(data, known=Known(solvent_viscosity=0.001)).chosen
    assert found.names[0] == "modes[0].viscosity"
    assert found.fluid.solvent_viscosity == 0.001
    assert found.fluid.modes[0].viscosity == pytest.approx(0.9, rel=0.05)
    assert found.fluid.modes[0].relaxation_time == pytest.approx(0.03, rel=0.05)


def test_modes_are_in_order_whatever_the_start(tmp_path):
    found = fit(measurements.read(measured(tmp_path)), modes=2).chosen
    times = [mode.relaxation_time for mode in found.fluid.modes]
    assert times == sorted(times, reverse=True)
    assert found.values.tolist() == pytest.approx(parameters(found.fluid).tolist())


def test_one_modulus_and_viscosities_are_enough(tmp_path):
    """A column that was not measured may be missing; swapped moduli would not fit."""
    x = rates(10, 0.1, 1e3)
    loss = tmp_path / "loss.csv"
    loss.write_text(csv_text(HYALURONIC_ACID, ("loss_modulus",), x), encoding="utf-8")
    shear = measured(tmp_path, frequency=None)
    found = fit(measurements.read([loss, *shear]), modes=2).chosen
    assert parameters(found.fluid) == pytest.approx(parameters(HYALURONIC_ACID), rel=1e-4)


def test_correlation_is_a_correlation(tmp_path):
    found = fit(measurements.read(measured(tmp_path, noise=NOISE)), modes=2).chosen
    assert np.diag(found.correlation) == pytest.approx(np.ones(7))
    assert np.abs(found.correlation).max() <= 1 + 1e-12
    assert np.linalg.eigvalsh(found.correlation).min() > 0
    at = {name: k for k, name in enumerate(found.names)}
    # what one mode takes, the other gives
    assert found.correlation[at["modes[0].viscosity"], at["modes[1].viscosity"]] < -0.5


# ------------------------------------------------------- normal stresses, and what is known before

BOGER = Fluid(1.0, (Mode(0.06, 0.3, 0.1),))  # hardly thins: 6 % at most
MEASURED_NORMAL = {"normal": (1.0, 1e3), "normal_noise": 0.1}


def test_normal_stresses_determine_the_mobility_where_the_viscosity_does_not(tmp_path):
    files = measured(tmp_path, BOGER, noise=NOISE, **MEASURED_NORMAL)
    with pytest.raises(
        DataError, match=r"modes\[0\].mobility: .*\n  what would help: first normal"
    ):
        fit(measurements.read(files[:2]), modes=1)
    found = fit(measurements.read(files)).chosen
    assert found.fluid.modes[0].mobility == pytest.approx(0.1, abs=3 * found.uncertainties[-1])
    assert found.uncertainties[-1] < 0.01


def test_normal_stresses_of_slow_shear_are_those_of_second_order(tmp_path):
    """N1 = 2 sum eta lambda gamma^2: a lost factor of two would halve the times."""
    rate = np.array([1e-3, 1e-2])
    exact = 2 * (0.257 * 0.0752 + 0.254 * 0.00848) * rate**2
    assert model("first_normal_stress_difference", rate, HYALURONIC_ACID) == pytest.approx(
        exact, rel=1e-5
    )


def test_normal_stresses_are_weighed_by_their_own_scatter(tmp_path):
    """With 3 % elsewhere and 10 % in N1 each is found, and N1 spoils nothing."""
    files = measured(tmp_path, noise=NOISE, per_decade=20, **MEASURED_NORMAL)
    found = fit(measurements.read(files), modes=2).chosen
    noise = found.data.groupby("quantity")["noise"].first()
    assert noise["viscosity"] == noise["storage_modulus"] == pytest.approx(NOISE, rel=0.15)
    assert noise["first_normal_stress_difference"] == pytest.approx(0.1, rel=0.3)
    alone = fit(measurements.read(files[:2]), modes=2).chosen
    assert np.all(found.uncertainties < 1.02 * alone.uncertainties)
    assert found.uncertainties[3] < 0.85 * alone.uncertainties[3]  # mobility of the slow mode
    assert np.abs(deviations(found, HYALURONIC_ACID)).max() < 3


def test_normal_stresses_that_scatter_less_are_not_trusted_more(tmp_path):
    files = measured(tmp_path, noise=NOISE, normal=(1.0, 1e3), normal_noise=1e-3)
    found = fit(measurements.read(files), modes=2).chosen
    assert found.data["noise"].nunique() == 1


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(tmp_path):
    """Of 95 % intervals of 7 parameters in 30 sets of data 95 % hold the true value.

    210 intervals, correlated within a set: their share scatters by 2 to 3 %.
    """
    found = []
    for seed in range(30):
        files = measured(tmp_path, noise=NOISE, seed=seed, **MEASURED_NORMAL)
        own = fit(measurements.read(files), modes=2).chosen
        found.append(deviations(own, HYALURONIC_ACID))
    assert 0.9 < np.mean(np.abs(found) < 1.96) < 0.99
    assert 0.7 < np.mean(np.square(found)) < 1.4
    assert np.abs(np.mean(found, axis=0)).max() < 0.6  # no bias: three errors of a mean of 30


def test_what_is_known_stays_and_is_not_counted(tmp_path):
    """One mode's time, as extensional rheometry gives it, and the other's mobility."""
    data = measurements.read(measured(tmp_path, noise=NOISE))
    known = Known(relaxation_times=(0.0752,), mobilities=(None, 0.49))
    found = fit(data, modes=2, known=known).chosen
    assert found.fluid.modes[0].relaxation_time == 0.0752
    assert found.fluid.modes[1].mobility == 0.49
    free = fit(data, modes=2).chosen
    assert set(free.names) - set(found.names) == {"modes[0].relaxation_time", "modes[1].mobility"}
    assert len(found.names) == len(found.values) == len(found.uncertainties) == 5
    squares = np.sum(found.data["residual"] ** 2)
    n = len(data)
    assert found.criterion == pytest.approx(n * math.log(squares / n) + 5 * math.log(n))
    shared = [free.names.index(name) for name in found.names]
    assert np.all(found.uncertainties <= free.uncertainties[shared] * 1.02)
    assert np.abs(deviations(found, HYALURONIC_ACID)).max() < 3
    text = " ".join(fit_report.as_yaml(found).replace("\n#", "").split())
    assert "Known, not fitted: modes[0].relaxation_time 0.0752, modes[1].mobility 0.49." in text


def test_known_mobilities_replace_measurements_of_steady_shear(tmp_path):
    data = measurements.read(measured(tmp_path, noise=NOISE, rate=None))
    found = fit(data, known=Known(mobilities=(0.283, 0.49))).chosen
    assert np.abs(deviations(found, HYALURONIC_ACID)).max() < 3
    assert found.fluid.modes[0].mobility == 0.283


def test_all_but_one_may_be_known(tmp_path):
    known = Known(0.02, (0.03,), (0.2,))
    found = fit(measurements.read(measured(tmp_path, ONE_MODE)), modes=1, known=known).chosen
    assert found.names == ("modes[0].viscosity",)
    assert found.values == pytest.approx([0.9], rel=1e-6)


def test_a_known_time_that_is_not_the_longest_is_refused(tmp_path):
    data = measurements.read(measured(tmp_path, noise=NOISE))
    message = r"modes\[1\].relaxation_time: 0\.07\d* s, slower than the mode before it, 0\.00848 s"
    with pytest.raises(DataError, match=message):
        fit(data, modes=2, known=Known(relaxation_times=(0.00848,)))


def test_known_numbers_of_more_modes_are_of_modes_that_there_are(tmp_path):
    data = measurements.read(measured(tmp_path, ONE_MODE, noise=NOISE))
    result = fit(data, known=Known(mobilities=(0.2,)))
    assert len(result.chosen.fluid.modes) == 1
    with pytest.raises(DataError, match="found known numbers of 2 modes; allowed: of at most 1"):
        fit(data, modes=1, known=Known(mobilities=(0.2, 0.3)))
    with pytest.raises(DataError, match=r"known relaxation times \[0\.1, 0\.2\]; allowed: above 0"):
        Known(relaxation_times=(0.1, 0.2))
    with pytest.raises(DataError, match=r"known mobility 1; allowed: number in \[0, 1\)"):
        Known(mobilities=(1.0,))


# ------------------------------------------------------------------------------------ refusals


def test_refuses_fewer_points_than_parameters(tmp_path):
    text = "shear_rate,viscosity\n0.1,1\n1,0.9\n10,0.5\n100,0.2\n"
    (tmp_path / "few.csv").write_text(text, encoding="utf-8")
    data = measurements.read([tmp_path / "few.csv"])
    message = "found 4 measured numbers; allowed: at least 5, more than the 4 parameters of a fluid"
    with pytest.raises(DataError, match=f"{message} with 1 mode$"):
        fit(data, modes=1)


def test_refuses_a_narrow_range(tmp_path):
    files = measured(tmp_path, per_decade=40, frequency=(10, 50), rate=(12, 60))
    message = r"rates from 10 to 6\d.* 1/s were measured, 0\.8 decades; allowed: at least 1"
    with pytest.raises(DataError, match=message):
        fit(measurements.read(files))


def test_moduli_alone_do_not_determine_mobilities_and_what_would_is_named(tmp_path):
    """Mobilities do not act in small oscillation; both kinds of steady shear determine them."""
    with pytest.raises(DataError) as caught:
        fit(measurements.read(measured(tmp_path, noise=NOISE, rate=None)))
    message = str(caught.value)
    assert message.startswith("the data do not determine a fluid with 2 modes:\n")
    for k in (0, 1):
        assert f"\n  modes[{k}].mobility: nothing that was measured depends on it\n" in message
    assert message.count("depends on it") == 2  # nothing else is open
    for quantity in ("viscosity", "first normal stress difference"):
        pattern = rf"what would help: {quantity} at shear rates of (\S+) to (\S+) 1/s \(modes\[0\]"
        low, high = map(float, re.search(pattern, message).groups())
        assert high > 1 / 0.0752  # where the slow mode thins
        assert low < 1e3
    assert "modulus at" not in message
    assert "fluid.fit.mobilities" in message


@pytest.mark.parametrize("kind", ["rate", "normal"])
def test_what_a_refusal_names_does_determine_the_fluid(kind, tmp_path):
    """The proposed range is measured, and the errors are as foretold."""
    quantity = {"rate": "viscosity", "normal": "first normal stress difference"}[kind]
    with pytest.raises(DataError) as caught:
        fit(measurements.read(measured(tmp_path, ONE_MODE, noise=NOISE, rate=None)))
    pattern = rf"{quantity} at shear rates of (\S+) to (\S+) 1/s \(modes\[0\].mobility to (\S+)\)"
    low, high, foretold = map(float, re.search(pattern, str(caught.value)).groups())
    spans = {"rate": None} | {kind: (low, high)}
    more = measured(tmp_path, ONE_MODE, noise=NOISE, normal_noise=0.05, **spans)
    found = fit(measurements.read(more), modes=1).chosen
    # foretold for a mobility of 0.3, true is 0.2
    assert found.uncertainties[-1] == pytest.approx(foretold, rel=0.7)
    assert abs(deviations(found, ONE_MODE)[-1]) < 3


def test_refuses_a_storage_modulus_without_modes(tmp_path):
    with pytest.raises(DataError, match="found a storage modulus; allowed: at least one mode"):
        fit(measurements.read(measured(tmp_path)), modes=0)


def test_refuses_normal_stresses_alone(tmp_path):
    files = measured(tmp_path, frequency=None, rate=None, normal=(1.0, 1e3))
    with pytest.raises(DataError, match="found normal stress differences only; allowed: with visc"):
        fit(measurements.read(files))


@pytest.mark.slow
def test_refuses_more_modes_than_the_data_show(tmp_path):
    files = measured(tmp_path, ONE_MODE, noise=NOISE)
    with pytest.raises(DataError) as caught:
        fit(measurements.read(files), modes=3)
    message = str(caught.value)
    assert message.startswith("the data do not determine a fluid with 3 modes:\n  modes[")
    assert "allowed: fewer modes (fluid.fit.modes)" in message


def test_refuses_a_plateau_that_hides_the_relaxation_time(tmp_path):
    """Slow flow only: viscosity and G'' of a Newtonian fluid, and a G' far below."""
    spans = {"frequency": (0.1, 1.5), "rate": (0.1, 1.5)}
    files = measured(tmp_path, noise=NOISE, **spans)
    with pytest.raises(DataError, match=r"do not determine a fluid .*\n  .*(uncertainty|limit)"):
        fit(measurements.read(files))


@pytest.mark.parametrize("factor", [1e3, 1 / (2 * math.pi)], ids=["mPa s", "Hz"])
def test_refuses_other_units_in_one_file(factor, tmp_path):
    """Viscosities in mPa s, or frequencies in Hz, do not fit to the rest."""
    files = measured(tmp_path, noise=NOISE)
    column = 1 if factor > 1 else 0
    path = files[1] if factor > 1 else files[0]
    head, *rows = path.read_text().splitlines()
    cells = [[float(cell) for cell in row.split(",")] for row in rows]
    for row in cells:
        row[column] *= factor
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in cells)]))
    with pytest.raises(DataError, match=r"misses the data by \d+ % \(rms\); allowed: 25 %.*Hz"):
        fit(measurements.read(files))


# ------------------------------------------------------------------------------------ bad files

OSCILLATION = "angular_frequency,storage_modulus,loss_modulus\n"
SHEAR = "shear_rate,viscosity\n"
WRONG = {
    "unknown column": (
        "frequency,viscosity\n1,2\n",
        1,
        "unknown column 'frequency'; did you mean angular_frequency?",
    ),
    "unlike any column": (
        "shear_rate,viscosity,temperature\n1,2,3\n",
        1,
        "unknown column 'temperature'; allowed: angular_frequency, storage_modulus, loss_modulus",
    ),
    "column twice": (
        "shear_rate,viscosity,viscosity\n1,2,3\n",
        1,
        "column 'viscosity' found 2 times",
    ),
    "no abscissa": (
        "viscosity\n2\n",
        1,
        "viscosity without the column shear_rate",
    ),
    "only an abscissa": (
        "shear_rate\n2\n",
        1,
        "nothing measured; allowed: storage_modulus, loss_modulus, viscosity, first_normal",
    ),
    "semicolons": (
        "# one line before\nshear_rate;viscosity\n1;2\n",
        2,
        "columns separated by semicolons; allowed: by commas",
    ),
    "tabs": (
        "shear_rate\tviscosity\n1\t2\n",
        1,
        "columns separated by tabs; allowed: by commas",
    ),
    "numbers first": (
        "1,2\n",
        1,
        "no column names; allowed: angular_frequency, ",
    ),
    "cells": (
        SHEAR + "1,2\n2,3,4\n",
        3,
        "found 3 cells; allowed: 2, as named",
    ),
    "no number": (
        SHEAR + "1,2\n\n2,high\n",
        4,
        "viscosity: found 'high'; allowed: a finite number",
    ),
    "formula": (
        "shear_rate,viscosity\n1,=A1*2\n2,3\n",
        2,
        "viscosity: found '=A1*2'; allowed: a finite number",
    ),
    "formula with commas": (
        'shear_rate,viscosity\n1,"=SUM(A1,B1)"\n2,3\n',
        2,
        "viscosity: found '=SUM(A1,B1)'; allowed: a finite number",
    ),
    "a line without an end": (
        "shear_rate,viscosity\n1," + "9" * 200_000 + "\n",
        2,
        "not comma-separated: field larger than field limit",
    ),
    "a name without an end": (
        "shear_rate," + "viscosity" * 1000 + "\n1,2\n",
        1,
        "unknown column 'viscosityviscosityviscosityviscosity...",
    ),
    "control characters": (
        "shear_rate,viscosity\n1,\x1b[2J\n",
        2,
        r"viscosity: found '\x1b[2J'; allowed: a finite number",
    ),
    "decimal comma": (
        SHEAR + '"1,5",2\n',
        2,
        "shear_rate: found '1,5' (write 1.5); allowed: a finite number",
    ),
    "nan": (
        SHEAR + "1,nan\n",
        2,
        "viscosity: found 'nan'; allowed: a finite number",
    ),
    "infinite": (
        SHEAR + "inf,1\n",
        2,
        "shear_rate: found 'inf'; allowed: a finite number",
    ),
    "negative": (
        OSCILLATION + "1,0.1,0.2\n2,-0.3,0.4\n",
        3,
        "storage_modulus: found -0.3; allowed: above 0",
    ),
    "normal stress below what is resolved": (
        "shear_rate,first_normal_stress_difference\n1,-0.5\n",
        2,
        "first_normal_stress_difference: found -0.5; allowed: above 0, or an empty cell below",
    ),
    "zero rate": (
        SHEAR + "0,1\n",
        2,
        "shear_rate: found 0; allowed: above 0",
    ),
    "viscosity out of range": (
        SHEAR + "1,2e9\n",
        2,
        "viscosity: found 2e+09; allowed: 1e-05 to 1e+08 Pa s. Is the unit Pa s?",
    ),
    "modulus out of range": (
        OSCILLATION + "1,1,1e-8\n",
        2,
        "loss_modulus: found 1e-08; allowed: 1e-06 to 1e+09 Pa. Is the unit Pa?",
    ),
    "frequency out of range": (
        OSCILLATION + "1e9,1,1\n",
        2,
        "angular_frequency: found 1e+09; allowed: 1e-06 to 1e+07 rad/s. Is the unit rad/s?",
    ),
    "unsorted": (
        SHEAR + "1,2\n10,1\n5,1.5\n",
        4,
        "shear_rate: found 5 after 10 in line 3; allowed: ascending",
    ),
    "repeated": (
        OSCILLATION + "1,2,3\n# again\n1,2.1,3.1\n",
        4,
        "angular_frequency: found 1 again, as in line 2; allowed: every value once",
    ),
    "value without its rate": (
        SHEAR + "1,2\n,3\n",
        3,
        "viscosity without a value of shear_rate",
    ),
    "not UTF-8": (
        (SHEAR + "1,2\n# 5 \xb0C\n").encode("latin-1"),
        3,
        "found the byte 0xb0; allowed: UTF-8 text",
    ),
    "empty": ("", 1, "no column names; allowed: angular_frequency, storage_modulus"),
    "no numbers": (SHEAR + ",\n", None, "no measured numbers"),
}


@pytest.mark.parametrize(("content", "line", "problem"), WRONG.values(), ids=WRONG)
def test_bad_file_is_named_with_its_line(content, line, problem, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(DataError) as caught:
        measurements.read([path])
    where = str(path) if line is None else f"{path}, line {line}"
    first, *rest = str(caught.value).splitlines()
    assert first == "measured data: 1 problem"
    assert rest[0].startswith(f"  {where}: {problem}")
    assert len(rest) == 1


def test_one_message_lists_the_problems_of_all_files(tmp_path):
    (tmp_path / "a.csv").write_text(SHEAR + "1,x\n2,-1\n", encoding="utf-8")
    (tmp_path / "b.csv").write_text(OSCILLATION + "1,2\n", encoding="utf-8")
    paths = [tmp_path / name for name in ("a.csv", "b.csv", "c.csv")]
    with pytest.raises(DataError) as caught:
        measurements.read(paths)
    message = str(caught.value)
    assert message.startswith("measured data: 4 problems\n")
    found = re.findall(r"(\w\.csv), line (\d)|(c\.csv): cannot be read: No such file", message)
    assert found == [("a.csv", "2", ""), ("a.csv", "3", ""), ("b.csv", "2", ""), ("", "", "c.csv")]


def test_a_long_list_of_problems_is_cut(tmp_path):
    (tmp_path / "a.csv").write_text(SHEAR + "1,x\n" * 50, encoding="utf-8")
    with pytest.raises(DataError) as caught:
        measurements.read([tmp_path / "a.csv"])
    lines = str(caught.value).splitlines()
    assert len(lines) == 2 + csv_files.MOST_PROBLEMS
    assert lines[-1] == "  ... and 30 more"


def test_comments_byte_order_mark_and_empty_cells_are_fine(tmp_path):
    text = (
        "\ufeff# rheometer\r\n viscosity , shear_rate,angular_frequency, loss_modulus\r\n"
        "2, 1,0.5,\r\n\r\n1,3,,\r\n,,0.7,9\r\n"
    )
    (tmp_path / "a.csv").write_text(text, encoding="utf-8", newline="")
    data = measurements.read([tmp_path / "a.csv"])
    found = data[["line", "quantity", "abscissa", "measured"]].values.tolist()
    assert found == [[3, "viscosity", 1, 2], [5, "viscosity", 3, 1], [6, "loss_modulus", 0.7, 9]]


# --------------------------------------------------------------------------------------- output


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    files = measured(tmp_path_factory.mktemp("data"), noise=NOISE)
    return fit(measurements.read(files))


def test_yaml_is_a_section_of_a_config(fitted):
    text = fit_report.as_yaml(fitted.chosen)
    fluid = parse_study(written() | yaml.safe_load(text)).fluid
    assert parameters(fluid) == pytest.approx(parameters(fitted.chosen.fluid), rel=1e-3)
    comments = " ".join(line[2:] for line in text.splitlines() if line.startswith("# "))
    assert comments.startswith("Fitted to 133 numbers in oscillation.csv, shear.csv, rms deviation")
    assert f"modes[0].viscosity {100 * fitted.chosen.uncertainties[1]:.1f} %" in comments
    assert max(map(len, text.splitlines())) < 100


def test_a_falling_shear_stress_is_told(fitted):
    assert "no unique steady flow" not in fit_report.as_yaml(fitted.chosen)
    thinning = Fluid(0.01, (Mode(1.0, 0.1, 0.9),))
    text = fit_report.as_yaml(dataclasses.replace(fitted.chosen, fluid=thinning))
    found = re.search(
        r"falls with the shear rate at (\S+) 1/s: no unique", text.replace("\n# ", " ")
    )
    rate = float(found[1])
    before, after = (model("viscosity", r, thinning) * r for r in (rate, 1.02 * rate))
    assert before > after


def test_dataset_holds_data_model_and_residuals(fitted, tmp_path):
    datasets.write(fit_report.dataset(fitted, {"title": "fit"}), tmp_path / "fit.nc")
    result = xr.load_dataset(tmp_path / "fit.nc")
    assert result["residual"].values == pytest.approx(np.log(result["model"] / result["measured"]))
    rows = result["quantity"] == "loss_modulus"
    expected = model("loss_modulus", result["abscissa"].values[rows], fitted.chosen.fluid)
    assert result["model"].values[rows] == pytest.approx(expected, rel=1e-12)
    assert result["value"].sel(parameter="modes[1].mobility") == fitted.chosen.values[-1]
    assert result["criterion"].sel(modes=2) == result["criterion"].min()
    assert result["determined"].sel(modes=2) == 1
    assert all("long_name" in result[name].attrs for name in result.variables)


@pytest.mark.slow
def test_script_writes_fluid_details_and_figure(tmp_path):
    files = measured(tmp_path, ONE_MODE, noise=NOISE)
    done = run_script("fluid_fit.py", *files, "--modes", "1", tmp_path / "out")
    assert "<- chosen" in output(done)
    found = {path.name for path in (tmp_path / "out").iterdir()}
    assert found == {"fluid.yaml", "fit.nc", "rheology.png", "rheology.pdf", "rheology.csv"}


# ---------------------------------------------------------------------------------- in a study

TINY = written()
FITTED = TINY | {"study": "fitted", "fluid": {"data": ["a.csv"]}}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("--modes", "7"), "argument --modes: invalid choice: 7"),
        (("--solvent-viscosity", "-1"), "found -1; allowed: number > 0"),
    ],
)
def test_script_refuses_options(option, message, tmp_path):
    done = run_script("fluid_fit.py", "a.csv", "out", *option, folder=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_study_takes_the_fitted_fluid(fitted, tmp_path):
    study = parse_study(FITTED | {"deborah": TINY["deborah"] | {"definition": "longest_mode"}})
    file = tmp_path / fitted_fluid_file(study)
    with pytest.raises(
        ConfigError, match=r"study fitted: 1 problem\n  fluid\.data: not fitted yet"
    ):
        with_fitted_fluid(study, tmp_path)
    with pytest.raises(FluidError, match="not fitted yet"):
        _ = study.dimensionless_fluid
    file.parent.mkdir(parents=True)
    file.write_text(fit_report.as_yaml(fitted.chosen), encoding="utf-8")
    known = with_fitted_fluid(study, tmp_path)
    assert known.fluid == FluidConfig.model_validate(fit_report.rounded(fitted.chosen.fluid))
    assert stages.flow(study).with_fluid(known.fluid.physical()) == stages.flow(known)
    assert parse_study(yaml.safe_load(stages.study_config(known).text())) == known


def test_a_study_that_writes_its_fluid_is_left_alone(tmp_path):
    study = parse_study(TINY)
    assert fitted_fluid_file(study) is None
    assert with_fitted_fluid(study, tmp_path) is study
    assert data_files(study, "config/tiny.yaml") == []


def test_a_fitted_newtonian_fluid_has_no_deborah_number(tmp_path):
    study = parse_study(FITTED)
    with pytest.raises(ConfigError, match=r"deborah\.values\[1\]: found 1.*fluid\.modes is empty"):
        with_fluid(study, FluidConfig(solvent_viscosity=1.0, modes=()))


def test_data_are_relative_to_the_config_file(tmp_path, monkeypatch):
    (tmp_path / "config").mkdir()
    (tmp_path / "run").mkdir()
    (tmp_path / "config" / "a.csv").touch()
    monkeypatch.chdir(tmp_path / "run")
    study = parse_study(FITTED)
    assert data_files(study, tmp_path / "config" / "x.yaml") == ["../config/a.csv"]
    with pytest.raises(ConfigError, match=r"fluid\.data\[0\]: there is no file a\.csv; allowed"):
        data_files(study, tmp_path / "run" / "x.yaml")


def test_excel_files_are_read(tmp_path):
    """A byte order mark, and the line ends of Windows."""
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbfshear_rate,viscosity\r\n1,2\r\n3,1\r\n")
    assert list(measurements.read([path])["measured"]) == [2, 1]
    path.write_bytes("shear_rate,viscosity\n1,2\n".encode("utf-16"))
    with pytest.raises(DataError, match="line 1: found the byte 0xff; allowed: UTF-8 text"):
        measurements.read([path])


def test_a_huge_file_is_not_read(tmp_path):
    path = tmp_path / "huge.csv"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    started = time.process_time()
    with pytest.raises(DataError, match="found 100 MB; allowed: at most 1 MB"):
        measurements.read([path])
    assert time.process_time() - started < 0.1


def test_the_example_is_fitted_and_says_that_it_is_synthetic():
    path = CONFIG / "synthetic_rheology.csv"
    assert path.read_text(encoding="utf-8").startswith("# Synthetic, not measured")
    found = fit(measurements.read([path]), modes=2).chosen
    assert not found.undetermined
    deviation = np.abs(parameters(found.fluid) / parameters(HYALURONIC_ACID) - 1)
    assert deviation.max() < 0.15


# --------------------------------------------------------------------------------------- figure


def texts(drawing):
    return " | ".join(text.get_text() for text in drawing.figure.findobj(Text))


def test_figure_shows_model_and_data(tmp_path):
    data = measurements.read(measured(tmp_path, noise=NOISE, **MEASURED_NORMAL))
    drawing = rheology(HYALURONIC_ACID, data, {1.0: 1 / 0.0752, 5.0: 5 / 0.0752})
    shown = drawing.data
    points = shown[shown["kind"] == "measured"]
    assert points.groupby("quantity").size().to_dict() == {
        "storage_modulus": 41,
        "loss_modulus": 41,
        "viscosity": 51,
        "first_normal_stress_difference": 31,
    }
    for quantity, unit in (
        ("storage_modulus", "Pa"),
        ("loss_modulus", "Pa"),
        ("viscosity", "Pa s"),
        ("first_normal_stress_difference", "Pa"),
    ):
        curve = shown[(shown["quantity"] == quantity) & (shown["kind"] == "model")]
        x = curve["abscissa_per_second"].to_numpy()
        assert curve["value"].to_numpy() == pytest.approx(model(quantity, x, HYALURONIC_ACID))
        assert set(curve["unit"]) == {unit}
        own = points[points["quantity"] == quantity]["abscissa_per_second"]
        assert x[0] < own.min() < own.max() < x[-1]
    found = texts(drawing)
    for words in (
        "angular frequency [rad/s]",
        "shear rate [1/s]",
        r"viscosity, $\eta$ [Pa s]",
        "measured",
    ):
        assert words in found
    assert "De = 5" in found
    assert "Weissenberg" in found and "two-mode Giesekus fluid" in found
    entries = [text.get_text() for text in drawing.figure.legends[0].get_texts()]
    assert entries == [
        "storage modulus $G'$",
        "loss modulus $G''$",
        "covered by the flow",
        "at the wall",
    ]
    oscillation, shear, normal = drawing.figure.axes
    drawn = {line.get_label(): line for line in oscillation.lines[::2]}  # lines, then symbols
    storage = shown[(shown["quantity"] == "storage_modulus") & (shown["kind"] == "model")]
    assert drawn["storage modulus $G'$"].get_ydata() == pytest.approx(storage["value"])
    assert {axes.get_yscale() for axes in (oscillation, shear, normal)} == {"log"}


def test_figure_marks_the_shear_rates_of_the_flow():
    """Of each De the line is at the wall, eight times the mean rate or more; all is in view."""
    drawing = rheology(HYALURONIC_ACID, rates={1.0: 1 / 0.0752, 3000.0: 3000 / 0.0752})
    walls = drawing.data[drawing.data["kind"] == "wall"].set_index("value")["abscissa_per_second"]
    scaled = DimensionlessFluid.from_physical(0.051, HYALURONIC_ACID.modes)
    for De in (1.0, 3000.0):
        assert walls[De] == pytest.approx(De / 0.0752 * wall_shear_rate(scaled, De))
        assert walls[De] > 8 * De / 0.0752
    oscillation, shear, normal = drawing.figure.axes
    for axes in (shear, normal):
        assert axes.get_xlim()[1] > walls[3000.0]
        (upper,) = axes.child_axes
        axes.figure.draw_without_rendering()
        assert upper.get_xlim()[1] == pytest.approx(0.0752 * axes.get_xlim()[1])
        dotted = [line.get_xdata() for line in axes.lines if line.get_ls() == ":"]
        assert [x[0] for x in dotted if len(x)] == list(walls)
    assert oscillation.get_xlim()[1] < 4e4


def test_figure_of_a_flow_that_is_not_unique_marks_none():
    thinning = Fluid(0.01, (Mode(1.0, 0.1, 0.9),))
    drawing = rheology(thinning, rates={20.0: 200.0})
    assert "wall" not in set(drawing.data["kind"])


def test_figure_of_a_newtonian_fluid_has_no_elasticity():
    drawing = rheology(Fluid(0.5))
    assert set(drawing.data["quantity"]) == {"loss_modulus", "viscosity"}
    assert "measured" not in texts(drawing)
    assert "Newtonian fluid" in texts(drawing)
    assert len(drawing.figure.axes) == 2
    eta = drawing.data.loc[drawing.data["quantity"] == "viscosity", "value"]
    assert eta.to_numpy() == pytest.approx(np.full(len(eta), 0.5))
    low, high = drawing.figure.axes[1].get_ylim()
    assert high / low > 50  # flat is seen as flat


@pytest.mark.slow
def test_figure_is_written_with_its_data(tmp_path):
    paper = study("paper")
    rates = stages.rheology(paper).shear_rates()
    assert rates[5.0] == pytest.approx(5 / 0.0752)
    drawing = rheology(paper.fluid.physical(), rates=rates)
    paths = drawings.save(drawing, tmp_path / "rheology")
    assert [path.name for path in paths] == ["rheology.png", "rheology.pdf", "rheology.csv"]
    again = drawings.save(rheology(paper.fluid.physical(), rates=rates), tmp_path / "again")
    for one, other in zip(paths, again, strict=True):
        assert one.read_bytes() == other.read_bytes()
