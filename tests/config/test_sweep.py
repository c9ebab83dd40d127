"""Several particle diameters in a config: a study for each, or one message about all of them."""

import pytest
import yaml
from harness import CONFIG
from hypothesis import given
from hypothesis import strategies as st
from test_config import MINIMAL, any_yaml, changed, leaves

from viscotrain.config import stages
from viscotrain.config.reading import load_study, parse_study
from viscotrain.config.sweep import config_of, load_studies, name_of, only, parse_studies
from viscotrain.errors import ConfigError

TWO = [10e-6, 30e-6]


def several(diameters, changes=None):
    return changed(
        {"particle.diameter": diameters, "trains.volume_fraction": [0.001]} | (changes or {})
    )


def problems_of(data):
    with pytest.raises(ConfigError) as caught:
        parse_studies(data)
    return list(caught.value.problems)


def test_each_diameter_is_the_study_that_it_would_be_alone():
    studies = parse_studies(several(TWO))
    assert [study.study for study in studies] == ["minimal/beta0.1", "minimal/beta0.3"]
    assert [study.confinement for study in studies] == pytest.approx([0.1, 0.3])
    for study, diameter in zip(studies, TWO, strict=True):
        alone = parse_study(several(diameter))
        assert study.model_copy(update={"study": "minimal"}) == alone
        for stage in (stages.flow, stages.table, stages.trains, stages.order, stages.units):
            assert stage(study) == stage(alone)


def test_a_single_diameter_is_one_study_with_its_own_name():
    assert parse_studies(MINIMAL) == (parse_study(MINIMAL),)


def test_diameters_that_differ_by_round_off_have_one_name():
    """30 um/100 um and 45 um/150 um are not the same number."""
    wide = several([15e-6, 45e-6], {"channel.diameter": 150e-6})
    assert [study.study for study in parse_studies(wide)] == ["minimal/beta0.1", "minimal/beta0.3"]


def test_the_record_of_one_is_a_config_of_its_own():
    for study in parse_studies(several(TWO)):
        written = yaml.safe_load(stages.study_config(study).text())
        assert parse_studies(written) == (study,)


def test_the_record_of_all_is_a_config_of_all():
    studies = parse_studies(several(TWO))
    assert parse_studies(yaml.safe_load(config_of(studies).text())) == studies
    assert name_of(studies) == "minimal"
    alone = parse_studies(MINIMAL)
    assert config_of(alone) == stages.study_config(*alone)
    assert name_of(alone) == "minimal"


@pytest.mark.parametrize(
    ("diameters", "problem"),
    [
        ([], "particle.diameter: found []; allowed: number in [1.0e-08, 1], or at least 2 of them"),
        (
            [2e-5],
            "particle.diameter: found [2.0e-05]; "
            "allowed: number in [1.0e-08, 1], or at least 2 of them",
        ),
        (
            [2e-5, 2e-5],
            "particle.diameter[1]: found 2.0e-05; allowed: more than the value before it, 2.0e-05",
        ),
        (
            [3e-5, 2e-5],
            "particle.diameter[1]: found 2.0e-05; allowed: more than the value before it, 3.0e-05",
        ),
        (
            [2e-5, 1e-4],
            "particle.diameter[1]: found 0.0001; allowed: less than channel.diameter, 0.0001",
        ),
        (
            [1e-5, "2e-5"],
            "particle.diameter[1]: found the text '2e-5' (write 2.0e-05); "
            "allowed: number in [1.0e-08, 1], or list of at least 2 of them, ascending",
        ),
        (
            [-1e-5, 2e-5],
            "particle.diameter[0]: found -1.0e-05; "
            "allowed: number in [1.0e-08, 1], or list of at least 2 of them, ascending",
        ),
    ],
)
def test_a_wrong_list_is_refused_by_item(diameters, problem):
    assert problem in problems_of(several(diameters))


def test_problems_of_all_diameters_stand_in_one_message_each_once():
    wrong = several([10e-6, 20e-6, 200e-6], {"dns.tolerence": 1, "trains.volume_fraction": [0.01]})
    found = problems_of(wrong)
    assert sorted(line.partition(":")[0] for line in found) == [
        "dns.tolerence",
        "particle.diameter[2]",
        "trains.volume_fraction[0]",
    ]
    assert any("for d/D = 0.1; the mean spacing would be 0.667 d" in line for line in found)


def test_a_table_is_of_one_diameter():
    given_table = several(TWO) | {"table": {"file": "velocity_table.nc"}}
    assert problems_of(given_table) == [
        "table.file: found with several of particle.diameter; allowed: a table is of one d/D"
    ]


def test_each_diameter_takes_the_conditions_of_the_map_that_suit_it():
    """(2/3) beta^2/phi is 2 d at phi = 1/3 of beta^2."""
    studies = parse_studies(
        several(TWO, {"design_map.volume_fraction": [0.0032, 0.0034, 0.029, 0.031]})
    )
    assert [s.design_map.volume_fraction for s in studies] == [(0.0032,), (0.0032, 0.0034, 0.029)]
    none = parse_studies(several(TWO, {"design_map.volume_fraction": [0.006]}))
    assert none[0].design_map.volume_fraction == (0.006,)  # which is above contact


def test_a_command_for_one_diameter_names_the_config_to_give_it(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(yaml.safe_dump(several(TWO)), encoding="utf-8")
    studies = load_studies(path)
    with pytest.raises(
        ConfigError, match=r"found 2; allowed: one here, as in results/minimal/beta0\.1"
    ):
        only(studies, str(path))
    assert only(studies[:1], str(path)) == studies[0]


@given(key=st.sampled_from(sorted(leaves(MINIMAL))), value=any_yaml)
def test_no_value_anywhere_is_worse_than_a_config_error(key, value):
    data = changed({key: value})
    if isinstance(data.get("particle"), dict) and key != "particle.diameter":
        data["particle"]["diameter"] = TWO
    try:
        parse_studies(data)
    except ConfigError as error:
        assert error.problems


@given(value=any_yaml)
def test_no_diameters_are_worse_than_a_config_error(value):
    try:
        parse_studies(several([1e-5, value]))
    except ConfigError as error:
        assert error.problems


def test_the_shipped_study_has_four_diameters():
    studies = load_studies(CONFIG / "confinement.yaml")
    assert [study.study for study in studies] == [f"confinement/beta0.{n}" for n in (1, 2, 3, 4)]
    with pytest.raises(ConfigError, match=r"particle\.diameter: found"):
        load_study(CONFIG / "confinement.yaml")
