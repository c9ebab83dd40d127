"""Pages that programs write: what they make of what they are given."""

import figure_captions
import generate_config_docs
import generate_results_docs
import generate_rule_graph
import pytest
import xarray as xr
import yaml
from marked_blocks import filled


def test_blocks_are_filled_in_their_places_only():
    page = "a\n<!-- x: begin -->\nold\n<!-- x: end -->\nb\n"
    once = filled(page, {"x": "new"})
    assert once == "a\n<!-- x: begin -->\n\nnew\n\n<!-- x: end -->\nb\n"
    assert filled(once, {"x": "new"}) == once
    with pytest.raises(ValueError, match="no place for the block 'y'"):
        filled(page, {"y": ""})


def test_a_statistic_and_its_errors_share_a_row():
    mean = ("station", [1.0], {"units": "mm", "long_name": "mean"})
    dataset = xr.Dataset({"m": mean, "m_halfwidth": mean, "m_model_error": mean, "halfwidth": mean})
    _, _, row, alone = generate_results_docs.table(dataset).splitlines()
    assert row == "| `m` | station | mm | mean; also `_halfwidth`, `_model_error` |"
    assert alone.startswith("| `halfwidth` |")


def test_flags_are_in_words():
    flag = {"long_name": "outcome", "flag_values": [0, 1], "flag_meanings": "solved not_converged"}
    row = generate_results_docs.table(xr.Dataset({"f": ((), 0, flag)})).splitlines()[-1]
    assert row == "| `f` |  |  | outcome: 0 solved, 1 not converged |"


def test_columns_of_a_file_have_a_unit_and_a_meaning_each(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("deborah,flow_rate_uL_per_min,even_percent,even_percent_halfwidth\n")
    words = {"deborah": "De", "flow_rate": "Q | A", "even_percent": "share"}
    *_, De, rate, even = generate_results_docs.columns(path, words).splitlines()
    assert De == "| `deborah` |  | De |"
    assert rate == r"| `flow_rate_uL_per_min` | uL/min | Q \| A |"
    assert even == "| `even_percent` | % | share; also `_halfwidth` |"
    with pytest.raises(ValueError, match=r"x\.csv: no meaning of the column flow_rate_uL_per_min"):
        generate_results_docs.columns(path, {"deborah": "De", "even": "share"})


def test_a_caption_in_a_sentence_names_no_condition(tmp_path):
    text = "How spheres | beads are grouped along the channel that they pass, at De = {{ s.d }}, "
    text += "phi{{ s.v }} (the volume fraction, see there). Above: more."
    found = figure_captions.first_sentences(text)
    assert found == "How spheres / beads are grouped along the channel that they pass."
    assert figure_captions.first_sentences("Short. Then more. End.") == "Short. Then more."
    picture = tmp_path / "results/tiny/figures/spacing_De1_phi_feed0.01.png"
    picture.parent.mkdir(parents=True)
    for file in (picture, picture.with_name("spacing_De5_phi_feed0.01.png")):
        file.touch()
        file.with_suffix(".nc").touch()
    *_, row = figure_captions.figures([tmp_path / "results/tiny"]).splitlines()
    assert row.startswith("| `figures/spacing_De*_phi_feed*` | `.nc` | Distribution of")
    assert "{" not in row


def test_defaults_of_keys_are_whole():
    """They were cut off where YAML begins a new line."""
    long = {f"key_{n}": float(n) for n in range(20)}
    assert yaml.safe_load(generate_config_docs.as_yaml(long)) == long
    assert generate_config_docs.as_yaml(None) == "null"
    assert generate_config_docs.as_yaml(5) == "5"


GRAPH = {"a": set(), "late": set(), "b": {"a"}, "c": {"b", "a"}, "all": {"a", "c", "late"}}


def test_implied_arrows_are_left_out():
    assert generate_rule_graph.reduced(GRAPH) == GRAPH | {"c": {"b"}, "all": {"c", "late"}}


def test_rules_stand_right_of_what_they_use_and_not_earlier_than_needed():
    graph = generate_rule_graph.reduced(GRAPH)
    found = {rule: generate_rule_graph.depth(graph, rule) for rule in graph}
    assert found == {"a": 0, "b": 1, "c": 2, "late": 2, "all": 3}


@pytest.mark.slow
def test_the_kept_drawing_is_that_of_the_rules():
    graph = generate_rule_graph.reduced(generate_rule_graph.rules("config/config.yaml"))
    kept = generate_rule_graph.PICTURE.read_text(encoding="utf-8")
    assert generate_rule_graph.drawing(graph) == kept
