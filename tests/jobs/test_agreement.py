"""Parts of one table belong together, or the message says which do not, and why."""

import itertools
import math
from pathlib import Path

import pytest
import xarray as xr

from viscotrain.config import stages
from viscotrain.config.reading import load_study
from viscotrain.errors import TableError
from viscotrain.jobs import provenance
from viscotrain.jobs.agreement import refuse_other_case, refuse_strangers

STUDY = load_study(Path(__file__).parents[2] / "config" / "config.yaml")
GEOMETRIES = (1.2, 1.6), (1.6, 1.2), (1.6, math.inf)


def part(study, sp, sf, code="0123"):
    return xr.Dataset(attrs=provenance.attributes("part", stages.dns(study, sp, sf), code))


def parts(study=STUDY):
    return {f"sp{sp:g}_sf{sf:g}.nc": part(study, sp, sf) for sp, sf in GEOMETRIES}


def changed(**sections):
    return STUDY.model_copy(
        update={
            name: getattr(STUDY, name).model_copy(update=values)
            for name, values in sections.items()
        }
    )


def test_parts_of_one_study_agree_though_their_deborah_numbers_differ():
    found = parts()
    assert len({part.attrs["settings"] for part in found.values()}) == 2  # one without De = 0
    shared = refuse_strangers(found)
    assert shared["simulations_digest"] == "0123"
    assert "confinement: 0.2\n" in shared["simulations_settings"]


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"dns": {"tolerance": 1e-8}}, "dns.tolerance 1e-08, not 1e-07"),
        ({"particle": {"diameter": 3e-5}}, "confinement 0.3, not 0.2"),
        ({"fluid": {"solvent_viscosity": 0.06}}, "dimensionless_fluid.solvent 0.1050"),
        (
            {"deborah": {"definition": "mean_relaxation_time"}},
            "De 1 with lambda_1 Ubar/D = 1.7",
        ),
    ],
)
def test_a_part_of_another_study_is_named_with_what_differs(sections, words):
    mixed = parts() | {"odd.nc": part(changed(**sections), 1.1, 1.1)}
    with pytest.raises(TableError) as caught:
        refuse_strangers(mixed)
    text = str(caught.value)
    assert "odd.nc: " in text and "sp1.1" not in text
    assert words in text


def test_a_part_of_another_program_is_named():
    mixed = parts() | {"old.nc": part(STUDY, 1.1, 1.1, code="4567")}
    with pytest.raises(TableError, match=r"old\.nc: code_digest 4567, not 0123"):
        refuse_strangers(mixed)


def test_a_part_that_says_nothing_is_refused_among_those_that_do():
    with pytest.raises(TableError, match=r"mute\.nc: .*confinement None, not 0\.2"):
        refuse_strangers(parts() | {"mute.nc": xr.Dataset()})
    assert refuse_strangers(dict(itertools.repeat(("mute.nc", xr.Dataset()), 1)))


def test_start_ups_of_several_deborah_numbers_agree():
    own = {f"De{De}": stages.transient(STUDY, De) for De in STUDY.deborah.values}
    datasets = {
        name: xr.Dataset(attrs=provenance.attributes("part", item, "0123"))
        for name, item in own.items()
    }
    assert refuse_strangers(datasets)["simulations_digest"] == "0123"


def finished_table(study=STUDY):
    """What a table says of the study that it is of."""
    De = list(study.deborah.values)
    longest = [study.deborah_longest_mode(each) for each in De]
    return xr.Dataset(
        coords={"deborah": De, "deborah_longest_mode": ("deborah", longest)},
        attrs=refuse_strangers(parts(study)),
    )


def test_a_finished_table_serves_a_study_of_the_same_case_with_other_trains_and_less_deborah():
    less = changed(deborah={"values": (0, 5)}, dns={"accuracy": 1e-3})
    refuse_other_case("table.nc", finished_table(), stages.given_table(less))


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"particle": {"diameter": 3e-5}}, "confinement: found 0.2; allowed: 0.3, as in"),
        ({"fluid": {"solvent_viscosity": 0.06}}, "dimensionless_fluid.solvent: found 0.0907"),
        ({"deborah": {"values": (0, 1, 7)}}, "found 7 in the config; allowed: one of the table's"),
        (
            {"deborah": {"definition": "mean_relaxation_time"}},
            "De = 1: found lambda_1 Ubar/D = 1; allowed: 1.7",
        ),
    ],
)
def test_a_finished_table_of_another_case_is_refused_with_what_differs(sections, words):
    with pytest.raises(TableError, match=r"table\.nc: not of this study") as caught:
        refuse_other_case("table.nc", finished_table(), stages.given_table(changed(**sections)))
    assert words in str(caught.value)


def test_a_file_that_is_no_velocity_table_is_refused():
    with pytest.raises(TableError, match=r"map\.nc: not of this study\n  found no velocity table"):
        refuse_other_case("map.nc", xr.Dataset({"deborah": 5.0}), stages.given_table(STUDY))
