"""Config: every kind of wrong value is named with what was found and what is allowed."""

import copy
import json
import math

import generate_config_docs
import jsonschema
import pytest
import yaml
from harness import CONFIG
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from viscotrain.config import stages
from viscotrain.config.geometries import check_geometries, pair_distances, simulated, wanted
from viscotrain.config.names import (
    fraction_name,
    geometry_name,
    number_name,
    parse_distance,
    parse_fraction,
    train_name,
)
from viscotrain.config.reading import load_study, parse_study, read_yaml, schema, with_fluid
from viscotrain.config.study import Study
from viscotrain.errors import ConfigError, ViscotrainError

SHIPPED = ["config.yaml", "paper.yaml", "tiny.yaml"]
INF = math.inf

# The keys that a study has to write, and no others.
MINIMAL = {
    "study": "minimal",
    "fluid": {
        "solvent_viscosity": 0.051,
        "modes": [
            {"viscosity": 0.257, "relaxation_time": 0.0752, "mobility": 0.283},
            {"viscosity": 0.254, "relaxation_time": 0.00848, "mobility": 0.49},
        ],
    },
    "channel": {"diameter": 100e-6, "length": 800},
    "particle": {"diameter": 20e-6},
    "deborah": {"values": [0, 1, 5]},
    "table": {"sp": [1.1, 1.5, 2.5, INF], "sf": [1.1, 2, INF]},
    "trains": {"deborah": [5], "volume_fraction": [0.004], "stations": [0, 400, 800]},
}
REMOVED = object()


def changed(changes):
    """The minimal config with values at dotted keys replaced, added or REMOVED."""
    data = copy.deepcopy(MINIMAL)
    for key, value in changes.items():
        *parents, last = (int(part) if part.isdigit() else part for part in key.split("."))
        place = data
        for part in parents:
            place = place[part] if isinstance(place, list) else place.setdefault(part, {})
        if value is REMOVED:
            del place[last]
        else:
            place[last] = value
    return data


def problems_of(data):
    with pytest.raises(ConfigError) as caught:
        parse_study(data)
    return list(caught.value.problems)


WRONG = {
    # out of range
    "solvent viscosity": (
        {"fluid.solvent_viscosity": 0},
        "fluid.solvent_viscosity: found 0; allowed: number in [1.0e-06, 100000000]",
    ),
    "mode viscosity": (
        {"fluid.modes.1.viscosity": -0.2},
        "fluid.modes[1].viscosity: found -0.2; allowed: number in [1.0e-06, 100000000]",
    ),
    "relaxation time": (
        {"fluid.modes.0.relaxation_time": 0.0},
        "fluid.modes[0].relaxation_time: found 0.0; allowed: number in [1.0e-09, 10000000]",
    ),
    "mobility above": (
        {"fluid.modes.0.mobility": 1},
        "fluid.modes[0].mobility: found 1; allowed: number in [0, 1)",
    ),
    "mobility below": (
        {"fluid.modes.0.mobility": -0.1},
        "fluid.modes[0].mobility: found -0.1; allowed: number in [0, 1)",
    ),
    "channel diameter": (
        {"channel.diameter": -1e-4},
        "channel.diameter: found -0.0001; allowed: number in [1.0e-06, 1]",
    ),
    "infinite length": (
        {"channel.length": INF},
        "channel.length: found .inf; allowed: finite number in (0, 100000]",
    ),
    "not a number": (
        {"channel.length": math.nan},
        "channel.length: found .nan; allowed: finite number in (0, 100000]",
    ),
    "dns method": (
        {"dns.method": "steady"},
        "dns.method: found the text 'steady'; allowed: one of quasi_steady, transient",
    ),
    "stretch that no mesh has": (
        {"dns.transient.max_stretch": 1},
        "dns.transient.max_stretch: found 1; allowed: number in [1.05, 10]",
    ),
    "start-up at rest": (
        {"verification.transient": [{"sp": 1.5, "sf": 1.5, "deborah": 0}]},
        "verification.transient[0].deborah: found 0; allowed: number in (0, 1000]",
    ),
    "closure": (
        {"trains.closure": "all"},
        "trains.closure: found the text 'all'; allowed: one of every_sphere, nearest",
    ),
    "memory that holds spheres back": (
        {"trains.memory": -0.1},
        "trains.memory: found -0.1; allowed: number in [0, 1]",
    ),
    "closure of a triplet": (
        {"verification.closure.distances": [1.5, 2]},
        "verification.closure.distances: found [1.5, 2]; "
        "allowed: list of numbers in [1.001, 100], at least 3",
    ),
    "negative De": (
        {"deborah.values": [-1, 0, 5]},
        "deborah.values[0]: found -1; allowed: number in [0, 1000]",
    ),
    "De definition": (
        {"deborah.definition": "shortest_mode"},
        "deborah.definition: found the text 'shortest_mode'; "
        "allowed: one of longest_mode, mean_relaxation_time",
    ),
    "distance at contact": (
        {"table.sf": [1, 2, INF]},
        "table.sf[0]: found 1; allowed: number in [1.001, 100] or .inf",
    ),
    "distance nan": (
        {"table.sf": [1.5, math.nan, INF]},
        "table.sf[1]: found .nan; allowed: number in [1.001, 100] or .inf",
    ),
    "volume fraction": (
        {"trains.volume_fraction": [0.004, 1.5]},
        "trains.volume_fraction[1]: found 1.5; allowed: number in (0, 1)",
    ),
    "negative station": (
        {"trains.stations": [-1, 400]},
        "trains.stations[0]: found -1; allowed: number >= 0",
    ),
    "order": (
        {"dns.velocity_order": 7},
        "dns.velocity_order: found 7; allowed: whole number in [3, 6]",
    ),
    "gap elements": (
        {"dns.gap_elements": 2},
        "dns.gap_elements: found 2; allowed: whole number in [3, 20]",
    ),
    "study name": (
        {"study": "../demo"},
        "study: found the text '../demo'; allowed: text of letters, digits, - and _",
    ),
    "no De": (
        {"deborah.values": []},
        "deborah.values: found []; allowed: list of numbers in [0, 1000], at least 1, ascending",
    ),
    # wrong type
    "text for number": (
        {"channel.diameter": "wide"},
        "channel.diameter: found the text 'wide'; allowed: number in [1.0e-06, 1]",
    ),
    "quoted number": (
        {"fluid.solvent_viscosity": "0.2"},
        "fluid.solvent_viscosity: found the text '0.2' (write 0.2); allowed: number in [1.0e-06, ",
    ),
    "per cent for a share": (
        {"particle.diameter_variation": 2},
        "particle.diameter_variation: found 2; allowed: number in [0, 0.1]",
    ),
    "number that YAML reads as text": (
        {"particle.diameter": "2e-5"},
        "particle.diameter: found the text '2e-5' (write 2.0e-05); "
        "allowed: number in [1.0e-08, 1], or list of at least 2 of them, ascending",
    ),
    "infinity without its point": (
        {"table.sp": [1.1, 2, "inf"]},
        "table.sp[2]: found the text 'inf' (write .inf); allowed: number in [1.001, 100] or .inf",
    ),
    "boolean for number": (
        {"channel.length": True},
        "channel.length: found true; allowed: number in (0, 100000]",
    ),
    "fraction for whole number": (
        {"trains.repeats": 20.0},
        "trains.repeats: found 20.0; allowed: whole number in [1, 100000]",
    ),
    "number for boolean": (
        {"dns.save_fields": 1},
        "dns.save_fields: found 1; allowed: true or false",
    ),
    "number for text": (
        {"study": 2026},
        "study: found 2026; allowed: text of letters, digits, - and _ (a name made of digits",
    ),
    "number for list": (
        {"deborah.values": 5},
        "deborah.values: found 5; allowed: list of numbers in [0, 1000]",
    ),
    "set for list": (
        {"deborah.values": {0, 5}},
        "deborah.values: found !!set {0: null, 5: null}; allowed: list of numbers in [0, 1000]",
    ),
    "duct without its side": (
        {"channel.shape": "square", "channel.diameter": None},
        "channel.side: missing; allowed: number in [1.0e-06, 1], with shape square",
    ),
    "tube without its diameter": (
        {"channel.diameter": None},
        "channel.diameter: missing; allowed: number in [1.0e-06, 1], with shape tube",
    ),
    "side of another shape": (
        {"channel.side": 100e-6},
        "channel.side: found with shape tube; allowed: with channel.shape: square only",
    ),
    "unknown shape": (
        {"channel.shape": "round"},
        "channel.shape: found the text 'round'; allowed: one of tube, square, rectangle",
    ),
    "sphere larger than a square": (
        {"channel": {"shape": "square", "side": 20e-6, "length": 800}},
        "particle.diameter: found 2.0e-05; allowed: less than channel.side, 2.0e-05",
    ),
    "sphere larger than the smaller side": (
        {"channel": {"shape": "rectangle", "width": 90e-6, "height": 15e-6, "length": 800}},
        "particle.diameter: found 2.0e-05; allowed: less than channel.height, 1.5e-05",
    ),
    "negative density": (
        {"fluid.density": -1.0},
        "fluid.density: found -1.0; allowed: number > 0",
    ),
    "number for section": (
        {"channel": 100e-6},
        "channel: found 0.0001; allowed: section with the keys shape, diameter",
    ),
    "empty section": (
        {"trains": None},
        "trains: found nothing; allowed: section with the keys deborah, volume_fraction",
    ),
    "number for mode": (
        {"fluid.modes": [0.257]},
        "fluid.modes[0]: found 0.257; allowed: section with the keys viscosity, relaxation_time",
    ),
    # missing and unknown keys
    "missing section": (
        {"particle": REMOVED},
        "particle: missing; allowed: section with the keys diameter",
    ),
    "missing key": (
        {"fluid.modes.1.mobility": REMOVED},
        "fluid.modes[1].mobility: missing; allowed: number in [0, 1)",
    ),
    "mistyped key": (
        {"dns.tolerence": 1e-9},
        "dns.tolerence: unknown key; did you mean dns.tolerance?",
    ),
    "mistyped section": (
        {"figure": {}},
        "figure: unknown key; did you mean figures?",
    ),
    "key in the wrong section": (
        {"seed": 3},
        "seed: unknown key; did you mean trains.seed?",
    ),
    "key of nothing known": (
        {"channel.colour": "blue"},
        "channel.colour: unknown key; allowed: shape, diameter, side",
    ),
    "key that is a number": (
        {"particle": {1: 2, "diameter": 20e-6}},
        "particle[1]: unknown key; allowed: diameter, diameter_variation, density",
    ),
    # keys that do not agree
    "De unsorted": (
        {"deborah.values": [0, 5, 1]},
        "deborah.values[2]: found 1; allowed: more than the value before it, 5",
    ),
    "De repeated": (
        {"deborah.values": [0, 5, 5.0]},
        "deborah.values[2]: found 5.0; allowed: more than the value before it, 5",
    ),
    "distances unsorted": (
        {"table.sp": [1.5, 1.1, INF]},
        "table.sp[1]: found 1.1; allowed: more than the value before it, 1.5",
    ),
    "distance after infinity": (
        {"table.sp": [1.5, INF, 2, INF]},
        "table.sp[2]: found 2; allowed: more than the value before it, .inf",
    ),
    "table open": (
        {"table.sf": [1.1, 2]},
        "table.sf[1]: found 2; allowed: as the last one .inf (no neighbour)",
    ),
    "table without distances": (
        {"table.sp": [INF]},
        "table.sp: found [.inf]; allowed: list of numbers in [1.001, 100] or .inf, at least 2, "
        "ascending, the last one .inf",
    ),
    "sphere as wide as the tube": (
        {"particle.diameter": 100e-6},
        "particle.diameter: found 0.0001; allowed: less than channel.diameter, 0.0001",
    ),
    "neither modes nor data": (
        {"fluid.modes": REMOVED},
        "fluid.modes: missing; allowed: list of modes, or fluid.data in its place",
    ),
    "modes without a solvent": (
        {"fluid.solvent_viscosity": REMOVED},
        "fluid.solvent_viscosity: missing; allowed: number > 0",
    ),
    "modes and data": (
        {"fluid.data": ["a.csv"]},
        "fluid.data: found with fluid.modes; allowed: one of the two",
    ),
    "fit without data": (
        {"fluid.fit": {"modes": 2}},
        "fluid.fit: found without fluid.data; allowed: with it only",
    ),
    "no data": (
        {"fluid": {"data": []}},
        "fluid.data: found []; allowed: list of paths without braces, at least 1, none twice, in "
        "place of modes",
    ),
    "one file without a list": (
        {"fluid": {"data": "a.csv"}},
        "fluid.data: found the text 'a.csv'; allowed: list of paths",
    ),
    "data twice": (
        {"fluid": {"data": ["a.csv", "b.csv", "a.csv"]}},
        "fluid.data[2]: found the text 'a.csv' again; allowed: every value once",
    ),
    "data that is no path": (
        {"fluid": {"data": [5]}},
        "fluid.data[0]: found 5; allowed: text",
    ),
    "number of modes": (
        {"fluid": {"data": ["a.csv"], "fit": {"modes": 7}}},
        "fluid.fit.modes: found 7; allowed: whole number in [0, 6]",
    ),
    "known time that is none": (
        {"fluid": {"data": ["a.csv"], "fit": {"relaxation_times": [None, 0]}}},
        "fluid.fit.relaxation_times[1]: found 0; allowed: number in [1e-09, 10000000] or null",
    ),
    "known times in the wrong order": (
        {"fluid": {"data": ["a.csv"], "fit": {"relaxation_times": [0.1, None, 0.2]}}},
        "fluid.fit.relaxation_times[2]: found 0.2; allowed: less than the value before it, 0.1",
    ),
    "known mobility": (
        {"fluid": {"data": ["a.csv"], "fit": {"mobilities": [1]}}},
        "fluid.fit.mobilities[0]: found 1; allowed: number in [0, 1) or null",
    ),
    "known mobility of no mode": (
        {"fluid": {"data": ["a.csv"], "fit": {"modes": 1, "mobilities": [None, 0.2]}}},
        "fluid.fit.mobilities[1]: found 0.2; allowed: at most 1 in the list, fluid.fit.modes",
    ),
    "draws": (
        {"fluid": {"data": ["a.csv"], "fit": {"draws": -1}}},
        "fluid.fit.draws: found -1; allowed: whole number in [0, 200]",
    ),
    "De without modes": (
        {"fluid.modes": [], "deborah.values": [0, 5]},
        "deborah.values[1]: found 5; allowed: 0, because fluid.modes is empty",
    ),
    "train De not in table": (
        {"trains.deborah": [5, 7]},
        "trains.deborah[1]: found 7; allowed: one of deborah.values (0, 1, 5)",
    ),
    "train De repeated": (
        {"trains.deborah": [5, 5.0]},
        "trains.deborah[1]: found 5.0 again; allowed: every value once",
    ),
    "volume fraction repeated": (
        {"trains.volume_fraction": [0.004, 0.002, 0.004]},
        "trains.volume_fraction[2]: found 0.004 again; allowed: every value once",
    ),
    "no volume fraction": (
        {"trains.volume_fraction": REMOVED},
        "trains.volume_fraction: missing; allowed: list of numbers in (0, 1), or "
        "trains.feed_volume_fraction in its place",
    ),
    "volume fractions of channel and feed": (
        {"trains.feed_volume_fraction": [0.0066]},
        "trains.volume_fraction: found with trains.feed_volume_fraction; allowed: one of the two",
    ),
    "list of no volume fraction": (
        {"trains.volume_fraction": []},
        "trains.volume_fraction: found []; allowed: list of numbers in (0, 1), at least 1",
    ),
    "volume fraction of the feed repeated": (
        {"trains.volume_fraction": REMOVED, "trains.feed_volume_fraction": [0.01, 0.01]},
        "trains.feed_volume_fraction[1]: found 0.01 again; allowed: every value once",
    ),
    "feed below contact": (
        {"trains.volume_fraction": REMOVED, "trains.feed_volume_fraction": [0.06]},
        "trains.feed_volume_fraction[0]: found 0.06; allowed: less than 0.05333 for d/D = 0.2; "
        "the mean spacing would be 0.889 d, below contact",
    ),
    "injection": (
        {"trains.injection": "random"},
        "trains.injection: found the text 'random'; allowed: one of uniform, poisson",
    ),
    "map of channel and feed": (
        {"design_map": {"volume_fraction": [0.004], "feed_volume_fraction": [0.004]}},
        "design_map.volume_fraction: found with design_map.feed_volume_fraction; allowed: one of "
        "the two",
    ),
    "map of the feed unsorted": (
        {"design_map": {"feed_volume_fraction": [0.01, 0.004]}},
        "design_map.feed_volume_fraction[1]: found 0.004; allowed: more than the value before it",
    ),
    "spacing below contact": (
        {"trains.volume_fraction": [0.03]},
        "trains.volume_fraction[0]: found 0.03; allowed: less than 0.02667 for d/D = 0.2; "
        "the mean spacing would be 0.889 d, below contact",
    ),
    "stations unsorted": (
        {"trains.stations": [0, 400, 400]},
        "trains.stations[2]: found 400; allowed: more than the value before it, 400",
    ),
    "station beyond the channel": (
        {"trains.stations": [0, 900]},
        "trains.stations[1]: found 900; allowed: at most channel.length, 800",
    ),
    "channel too short for a train": (
        {"channel.length": 3, "trains.stations": [0, 3]},
        "channel.length: found 3; allowed: at least 4, three mean spacings at volume fraction 0.00",
    ),
    "field not in table": (
        {"figures.field": {"sp": 1.1, "sf": 1.1, "deborah": [0, 2]}},
        "figures.field.deborah[1]: found 2; allowed: one of deborah.values (0, 1, 5)",
    ),
    # movies and design map
    "view longer than the channel": (
        {"movies": {"field_of_view": 801}},
        "movies.field_of_view: found 801; allowed: at most channel.length, 800",
    ),
    "view of nothing": (
        {"movies": {"field_of_view": 0}},
        "movies.field_of_view: found 0; allowed: number >= 0.5",
    ),
    "frame rate not positive": (
        {"movies": {"frame_rate": -25}},
        "movies.frame_rate: found -25; allowed: number in [0.1, 120]",
    ),
    "movie without time": (
        {"movies": {"interval": 0.0}},
        "movies.interval: found 0.0; allowed: number in [1.0e-06, 10000]",
    ),
    "movie of one frame": (
        {"movies": {"frames": 1}},
        "movies.frames: found 1; allowed: whole number in [2, 1000000]",
    ),
    "odd width": (
        {"movies": {"width": 641}},
        "movies.width: found 641; allowed: whole number in [480, 3840], even",
    ),
    "movie of a train that there is not": (
        {"movies": {"deborah": [1]}},
        "movies.deborah[0]: found 1; allowed: one of trains.deborah (5)",
    ),
    "movie of a volume fraction that there is not": (
        {"movies": {"volume_fraction": [0.004, 0.01]}},
        "movies.volume_fraction[1]: found 0.01; allowed: one of trains.volume_fraction (0.004)",
    ),
    "map De not in table": (
        {"design_map": {"deborah": [1, 2]}},
        "design_map.deborah[1]: found 2; allowed: one of deborah.values (0, 1, 5)",
    ),
    "droplets that never come": (
        {"encapsulation": {"droplet_frequency": 0}},
        "encapsulation.droplet_frequency: found 0; allowed: number in [1.0e-06, 1000000000]",
    ),
    "map of volume fractions unsorted": (
        {"design_map": {"volume_fraction": [0.01, 0.004]}},
        "design_map.volume_fraction[1]: found 0.004; allowed: more than the value before it, 0.01",
    ),
    "map below contact": (
        {"design_map": {"volume_fraction": [0.004, 0.03]}},
        "design_map.volume_fraction[1]: found 0.03; allowed: less than 0.02667 for d/D = 0.2",
    ),
    "map longer than the train": (
        {"design_map": {"volume_fraction": [1e-6]}},
        "channel.length: found 800; allowed: at least 1.6e+04, three mean spacings at volume",
    ),
}


@pytest.mark.parametrize(("changes", "message"), WRONG.values(), ids=WRONG)
def test_wrong_value_is_the_only_problem(changes, message):
    (problem,) = problems_of(changed(changes))
    assert problem.startswith(message)


@pytest.mark.parametrize(
    ("table", "problems"),
    [
        (
            {"file": "velocity_table.nc", "sp": [1.1, INF]},
            ["table.sp: found with table.file; allowed: one of the two"],
        ),
        (
            {"file": "velocity_table.nc", "line_spacing": 3},
            ["table.line_spacing: found with table.file; allowed: one of the two"],
        ),
        (
            {},
            [
                "table.sp: missing; allowed: list of distances, or table.file in its place",
                "table.sf: missing; allowed: list of distances, or table.file in its place",
            ],
        ),
    ],
)
def test_a_table_is_computed_or_given(table, problems):
    assert problems_of(changed({}) | {"table": table}) == problems


def test_a_study_with_a_finished_table_simulates_nothing():
    study = parse_study(changed({}) | {"table": {"file": "velocity_table.nc"}})
    assert study.field_point() is None
    assert not simulated(study)


def test_one_message_lists_every_problem():
    """Cross-field problems are found although their own and other sections are wrong too."""
    changes = {
        "study": 5,
        "fluid.modes.0.mobility": 1.2,
        "fluid.modes.1.time": 3,
        "particle.diameter": 200e-6,
        "deborah.definition": "mean",
        "table.sp": [1.1, "x", 3, 2],
        "dns": {"order": 3, "tolerance": "1e-9"},
        "trains.deborah": [7, "5", 7],
        "trains.stations": [0, 900, 800],
        "trains.repeats": 0,
        "figures": {"field": {"sp": 9, "sf": 9}},
        "sed": 1,
    }
    keys = [problem.partition(": ")[0] for problem in problems_of(changed(changes))]
    assert sorted(keys) == sorted(
        [
            "study",
            "fluid.modes[0].mobility",
            "fluid.modes[1].time",
            "particle.diameter",
            "deborah.definition",
            "table.sp[1]",
            "table.sp[3]",  # not ascending
            "table.sp[3]",  # not .inf
            "dns.order",
            "dns.tolerance",
            "trains.deborah[0]",
            "trains.deborah[1]",
            "trains.deborah[2]",  # not in the table
            "trains.deborah[2]",  # repeated
            "trains.stations[1]",
            "trains.stations[2]",  # not ascending
            "trains.repeats",
            "figures.field.sf",
            "figures.field.deborah",
            "sed",
        ]
    )


def leaves(data, prefix=""):
    """Dotted keys of everything in a config, sections and items included."""
    pairs = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in pairs:
        yield f"{prefix}{key}"
        if isinstance(value, dict | list):
            yield from leaves(value, f"{prefix}{key}.")


any_yaml = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4) | st.dates(),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text(max_size=4) | st.integers(), inner, max_size=3)
    ),
    max_leaves=6,
)


@given(key=st.sampled_from(sorted(leaves(MINIMAL))), value=any_yaml)
def test_no_value_anywhere_is_worse_than_a_config_error(key, value):
    try:
        parse_study(changed({key: value}))
    except ConfigError as error:
        assert error.problems


def test_message_begins_with_source_and_count():
    with pytest.raises(ConfigError) as caught:
        parse_study(changed({"trains.seed": -1, "channel.length": 0}), source="my_study.yaml")
    first, *rest = str(caught.value).splitlines()
    assert first == "my_study.yaml: 2 problems"
    assert rest == [
        "  channel.length: found 0; allowed: number in (0, 100000]",
        "  trains.seed: found -1; allowed: whole number in [0, 9223372036854775807]",
    ]
    assert isinstance(caught.value, ViscotrainError)
    assert isinstance(caught.value, ValueError)


def test_long_values_are_shortened():
    (problem,) = problems_of(changed({"particle": list(range(1000))}))
    assert len(problem) < 150


@pytest.mark.parametrize("data", [None, [], "text", 5])
def test_config_that_is_no_mapping(data):
    (problem,) = problems_of(data)
    assert problem.startswith("found ")
    assert "allowed: section with the keys study, fluid, channel" in problem


def test_empty_mapping_names_every_required_key():
    keys = [problem.partition(": ")[0] for problem in problems_of({})]
    assert keys == ["study", "fluid", "channel", "particle", "deborah", "table", "trains"]


FILES = {
    "empty": ("", "found nothing; allowed: section with the keys study"),
    "only a comment": ("# study\n", "found nothing; allowed: section with the keys study"),
    "plain text": ("hello", "found the text 'hello'; allowed: section with the keys study"),
    "tabs": ("fluid:\n\tmodes: []\n", "not YAML: line 2, column 1: found character '\\t'"),
    "open bracket": ("study: [a\n", "not YAML: line 2, column 1: "),
    "binary": (b"\x89HDF\r\n\x1a\n\xff", "not YAML: "),
    "impossible date": ("study: 2026-13-45\n", "not YAML: "),
    "two documents": ("study: a\n---\nstudy: b\n", "not YAML: line 2, column 1: "),
}


@pytest.mark.parametrize(("content", "message"), FILES.values(), ids=FILES)
def test_file_that_is_no_config(tmp_path, content, message):
    path = tmp_path / "study.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ConfigError) as caught:
        load_study(path)
    assert str(caught.value).startswith(f"{path}: 1 problem\n  {message}")


def test_missing_file(tmp_path):
    with pytest.raises(ConfigError, match=r"nowhere\.yaml: 1 problem\n.*No such file"):
        load_study(tmp_path / "nowhere.yaml")


def test_repeated_keys_are_listed_with_their_lines_and_other_problems(tmp_path):
    path = tmp_path / "study.yaml"
    text = yaml.safe_dump(MINIMAL | {"sed": 1}, sort_keys=False)
    text = text.replace("channel:\n", "channel:\n  length: 80\n")
    line = text.splitlines().index("  length: 80") + 1
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_study(path)
    repeated, unknown = caught.value.problems
    assert repeated == (
        f"channel.length: found twice, in lines {line} and {line + 2}; allowed: once"
    )
    assert unknown.startswith("sed: unknown key")


def test_study_built_directly_is_checked_too():
    with pytest.raises(ValidationError, match=r"less than channel\.diameter"):
        Study.model_validate(changed({"particle.diameter": 1.0}))


def test_study_is_immutable():
    study = parse_study(MINIMAL)
    with pytest.raises(ValidationError, match="frozen"):
        study.channel.length = 5


# ----------------------------------------------------------------------------- shipped configs


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_config_is_valid(name):
    path = CONFIG / name
    assert load_study(path).study == ("demo" if name == "config.yaml" else path.stem)


def test_paper_is_the_study_of_the_contract():
    study = load_study(CONFIG / "paper.yaml")
    assert study.deborah.values == (0, 1, 2, 5, 10, 31, 62)
    assert study.trains.volume_fraction == (0.002, 0.004, 0.006, 0.01)
    for distances in (study.table.sp, study.table.sf):
        assert len(distances) == 14
        assert (distances[0], *distances[-2:]) == (1.02, 12, INF)


@pytest.mark.parametrize("name", SHIPPED)
def test_resolved_yaml_round_trips(name, tmp_path):
    study = load_study(CONFIG / name)
    path = tmp_path / "resolved.yaml"
    text = stages.study_config(study).text()
    path.write_text(text, encoding="utf-8")
    assert load_study(path) == study
    assert stages.study_config(load_study(path)).text() == text
    assert ".inf" in text


# ------------------------------------------------------------------------------- generated docs


def test_documents_are_in_step_with_the_models(capsys):
    assert generate_config_docs.main(["--check"]) == 0, capsys.readouterr().out


def test_check_reports_documents_out_of_step(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "config"
    folder.mkdir()
    monkeypatch.setattr(generate_config_docs, "CONFIG_FOLDER", folder)
    assert generate_config_docs.main(["--check"]) == 1
    assert "config/README.md is out of step" in capsys.readouterr().out
    assert not list(folder.iterdir())
    assert generate_config_docs.main([]) == 0
    assert generate_config_docs.main(["--check"]) == 0
    (folder / "schema.json").write_text("{}", encoding="utf-8")
    assert generate_config_docs.main(["--check"]) == 1


def test_every_key_is_documented():
    readme = generate_config_docs.readme()

    def keys(model, prefix):
        for name, value in model:
            yield f"{prefix}{name}"
            if isinstance(value, tuple) and value and hasattr(value[0], "model_fields_set"):
                yield from keys(value[0], f"{prefix}{name}[].")
            elif hasattr(value, "model_fields_set"):
                yield from keys(value, f"{prefix}{name}.")

    study = load_study(CONFIG / "tiny.yaml")  # it has modes and figures.field
    documented = [key for key in keys(study, "") if f"| `{key}` |" in readme]
    sections = {name for name, value in study if hasattr(value, "model_fields_set")}
    assert set(documented) | sections == set(keys(study, ""))
    assert len(documented) > 30


@pytest.mark.parametrize("name", SHIPPED)
def test_schema_accepts_shipped_configs(name):
    jsonschema.Draft202012Validator.check_schema(schema())
    jsonschema.validate(read_yaml(CONFIG / name)[0], schema())


@pytest.mark.parametrize("changes", [{"channel.length": -1}, {"sed": 1}, {"table.sp": [1.1]}])
def test_schema_refuses_wrong_configs(changes):
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(changed(changes), schema())
    json.dumps(schema(), allow_nan=False)


# ------------------------------------------------------------------------------ derived values


def test_defaults_fill_what_is_not_written():
    study = parse_study(MINIMAL)
    assert study.deborah.definition == "longest_mode"
    assert (study.table.check, study.table.max_holes) == (3, 0)
    assert (study.trains.repeats, study.trains.seed, study.trains.passages) == (20, 1, 1000)
    assert study.figures.field is None


def test_geometries_are_the_grid():
    study = parse_study(MINIMAL)
    assert len(study.geometries) == 4 * 3
    assert study.geometries[:3] == ((1.1, 1.1), (1.1, 2), (1.1, INF))


def test_mean_relaxation_time_is_converted_to_the_longest_mode():
    mean = (0.257 * 0.0752 + 0.254 * 0.00848) / (0.257 + 0.254)
    study = parse_study(changed({"deborah.definition": "mean_relaxation_time"}))
    assert study.deborah_longest_mode(5) == pytest.approx(5 * 0.0752 / mean, rel=1e-14)
    assert study.deborah_longest_mode(0) == 0
    assert parse_study(MINIMAL).deborah_longest_mode(5) == 5


@pytest.mark.parametrize("definition", ["longest_mode", "mean_relaxation_time"])
def test_newtonian_study_has_no_other_deborah_than_zero(definition):
    study = parse_study(
        changed(
            {
                "fluid.modes": [],
                "deborah": {"values": [0], "definition": definition},
                "trains.deborah": [0],
            }
        )
    )
    assert study.deborah_longest_mode(0) == 0
    assert study.dimensionless_fluid.solvent == 1
    assert stages.units(study).longest_modes() == {0: 0}
    assert stages.units(study).shear_rates() == {}


def test_field_point_is_chosen_or_configured():
    assert tuple(parse_study(MINIMAL).field_point()) == (
        ("sp", 1.1),
        ("sf", 1.1),
        ("deborah", (0, 1, 5)),
    )
    several = {"deborah.values": [0, 1, 2, 5, 10, 31, 62], "trains.deborah": [31]}
    assert parse_study(changed(several)).field_point().deborah == (0, 2, 5, 31)
    fast = parse_study(changed({"deborah.values": [40, 62], "trains.deborah": [40]}))
    assert fast.field_point().deborah == (40,)
    point = {"sp": 2.5, "sf": 2.0, "deborah": (1.0, 5.0)}
    assert parse_study(changed({"figures.field": point})).field_point().model_dump() == point


# --------------------------------------------------------------------------------- names, points

distances = st.floats(min_value=1, max_value=1e6, exclude_min=True) | st.just(INF)


@given(distances)
def test_distance_names_are_read_back_exactly(distance):
    assert parse_distance(number_name(distance)) == distance
    assert "_" not in number_name(distance)


def test_names():
    assert geometry_name(1.1, INF) == "sp1.1_sfinf"
    assert geometry_name(2, 2.0) == "sp2_sf2"
    assert train_name(5.0, 0.004) == "De5_phi0.004"
    assert train_name(5.0, 0.0066, feed=True) == "De5_phi_feed0.0066"
    for feed in (False, True):
        assert parse_fraction(fraction_name(0.0066, feed)) == 0.0066
    assert number_name(-0.0) == "0"
    assert number_name(1.1) != number_name(math.nextafter(1.1, 2))


def test_a_study_of_the_feed():
    """Trains and movies by what is poured in; the map keeps its own way."""
    feed = {"trains.volume_fraction": REMOVED, "trains.feed_volume_fraction": [0.0066, 0.01]}
    study = parse_study(changed(feed | {"movies": {"volume_fraction": [0.01]}}))
    assert study.trains.feed and study.trains.fractions == (0.0066, 0.01)
    assert study.movie_conditions() == ((5, 0.01),)
    assert stages.trains(study).feed and not stages.design_points(study).feed
    assert not study.map_feed
    assert stages.schematic(study).feed
    mapped = parse_study(changed(feed | {"design_map": {"feed_volume_fraction": [0.002, 0.02]}}))
    assert mapped.map_feed and stages.design_points(mapped).feed
    assert {phi for _, phi in mapped.map_conditions()} == {0.002, 0.02}
    feed["trains.feed_volume_fraction"] = [0.001, 0.0015]
    small = parse_study(changed(feed | {"particle.diameter": 5e-6}))  # nothing usual fits
    assert small.map_feed and small.map_conditions()[0][1] == 0.001


def grid(sp, sf, check):
    data = changed({"table.sp": [*sp, INF], "table.sf": [*sf, INF], "table.check": check})
    return parse_study(data)


def test_check_geometries_lie_next_to_contact_first():
    sp, sf = check_geometries(grid([1.1, 1.5, 2.5], [1.2, 2], 3))[0]
    assert (sp, sf) == (1.269, 1.5)  # 2/(1/1.1 + 1/1.5), 2/(1/1.2 + 1/2)


def test_check_geometries_reach_beyond_the_last_distance():
    assert check_geometries(grid([1.5], [1.1, 2], 5)) == ((3.0, 1.419), (3.0, 4.0))


def test_no_check_geometries_on_request():
    assert check_geometries(grid([1.1, 2], [1.1, 2], 0)) == ()


def test_pairs_are_finer_than_triplets_and_reach_farther():
    study = grid([1.1, 2], [1.1, 3], 0)
    expected = (1.1, 1.419, 2, 2.4, 3, 4.5, 6.75, 10.12, 15.18)
    assert pair_distances(study) == expected
    assert all((s, INF) in wanted(study) for s in expected)
    own = parse_study(changed({"table.pair": [1.7, 20.0]}))
    assert pair_distances(own) == tuple(sorted({*own.table.sp[:-1], *own.table.sf[:-1], 1.7, 20.0}))


def test_triplets_on_lines_of_the_grid():
    axis = [1.1, 1.3, 1.6, 2, 2.5, INF]
    study = parse_study(changed({"table.sp": axis, "table.sf": axis, "table.line_spacing": 3}))
    triplets = {each for each, De in simulated(study).items() if 5.0 in De}
    lines, others = {1.1, 2}, {1.3, 1.6, 2.5}
    assert {(sp, sf) for sp in axis[:-1] for sf in lines} <= triplets
    assert {(sp, sf) for sp in lines for sf in axis[:-1]} <= triplets
    assert not {(sp, sf) for sp in others for sf in others} & triplets
    assert {(s, INF) for s in axis} <= triplets
    assert set(check_geometries(study)) <= triplets
    with pytest.raises(ConfigError, match=r"table.check: found 0; allowed: at least 1 with"):
        parse_study(changed({"table.line_spacing": 2, "table.check": 0}))


# nodes from 1.01 to 30, no closer than a config may have them
nodes = st.integers(min_value=0, max_value=1500).map(lambda n: round(1.01 * 1.00226**n, 4))
axes = st.lists(nodes, min_size=1, max_size=8, unique=True).map(sorted)


@given(sp=axes, sf=axes, check=st.integers(min_value=0, max_value=20))
def test_check_geometries_lie_in_cells_of_their_own(sp, sf, check):
    study = grid(sp, sf, check)
    points = check_geometries(study)

    def cell(nodes, value):
        assert nodes[0] < value < nodes[-1]
        assert value not in nodes
        return sum(node < value for node in nodes)

    cells = {(cell(study.table.sp, a), cell(study.table.sf, b)) for a, b in points}
    assert len(cells) == len(points)
    assert len(points) == min(check, len(sp) * len(sf))
    fewer = check_geometries(grid(sp, sf, max(check - 1, 0)))
    assert points[: len(fewer)] == fewer


def test_sides_of_a_rectangle_may_come_in_either_order():
    """D is the smaller one; spheres touch at less phi than in a tube, by pi/4 over their ratio."""
    sides = {"width": 300e-6, "height": 100e-6}
    for channel in (sides, dict(zip(sides, reversed(sides.values()), strict=True))):
        study = changed({"channel": {"shape": "rectangle", "length": 800, **channel}})
        own = parse_study(study).channel
        assert own.inscribed_diameter == 100e-6
        assert own.section.aspect_ratio == pytest.approx(3)
        assert parse_study(study).confinement == pytest.approx(0.2)
        close = changed(
            {
                "channel": {"shape": "rectangle", "length": 800, **channel},
                "trains.volume_fraction": [0.0069],
            }
        )
        assert parse_study(close).mean_spacing(0.0069) == pytest.approx(
            math.pi / 18 * 0.04 / 0.0069
        )
        (problem,) = problems_of(close | {"design_map": {"volume_fraction": [0.0071]}})
        assert problem.startswith("design_map.volume_fraction[0]: found 0.0071; allowed: less than")


def test_the_density_of_a_fitted_fluid_is_kept():
    measured = changed({"fluid": {"data": ["a.csv"], "density": 1100.0}})
    study = parse_study(measured)
    fluid = parse_study(changed({})).fluid
    assert with_fluid(study, fluid).fluid.density == 1100.0
    written = stages.study_config(study).with_fluid(fluid.physical())
    assert written.config["fluid"]["density"] == 1100.0
