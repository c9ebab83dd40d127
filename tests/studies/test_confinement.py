"""Comparison of diameters: from tables with a known power of beta to exponents and words."""

import itertools

import numpy as np
import pytest
import xarray as xr
from synthetic import dns_result

from viscotrain.config.settings import ConfinementSettings
from viscotrain.studies import confinement
from viscotrain.table.assembly import combine
from viscotrain.table.interpolation import VelocityTable

BETA = (0.1, 0.2, 0.4)
POWER = 3.9
ACCURACY = 1e-8
GRID = [1.05, 2.0, np.inf]
NODES = [1.05, 1.2, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0]
SETTINGS = ConfinementSettings(
    diameters=("beta0.1", "beta0.2", "beta0.4"), length=800.0, accuracy=ACCURACY
)


def repulsion(s, beta):
    """Of a pair: a power of beta times a function of the distance of surfaces in D."""
    with np.errstate(invalid="ignore"):
        xi = (s - 1) * beta
        return np.where(np.isinf(s), 0.0, beta**POWER * np.exp(-xi / 0.5) * (1 + xi))


def table(beta):
    """Pairs that move apart, half of it by either sphere; a third sphere changes nothing."""
    results = []
    for sp, sf in {*itertools.product(GRID, GRID), *((s, np.inf) for s in NODES)}:
        one = dns_result(sp, sf)
        behind, ahead = repulsion(sp, beta), repulsion(sf, beta)
        U = 1.7 + np.array([-behind, behind - ahead, ahead]) / 2
        U[np.isinf([sp, 0.0, sf])] = np.nan
        one["velocity"] = one["velocity"].dims, np.stack([0 * U + 1.7, U])
        one["confinement"] = beta
        results.append(one)
    made = combine(results, sp=GRID, sf=GRID, pair=NODES, deborah=[0, 1], max_holes=0)
    made.attrs["simulations_settings"] = f"confinement: {beta}"
    return VelocityTable(made.assign(pair_error=0 * made["pair_error"]))


def order(beta):
    """At De = 1 trains order, along the shortest length at a gap of 0.3 D; at 0 they do not."""
    s = np.linspace(1.2, 8, 69)
    xi = (s - 1) * beta
    length = 10 * beta**-4 * (1 + (xi - 0.3) ** 2)
    return xr.Dataset(
        {"ordering_length": (("deborah", "spacing"), np.array([np.full_like(s, np.inf), length]))},
        coords={
            "deborah": [0.0, 1.0],
            "spacing": s,
            "volume_fraction": ("spacing", 2 / 3 * beta**2 / s),
        },
    )


@pytest.fixture(scope="module")
def found():
    return confinement.compare(
        [table(beta) for beta in BETA], [order(beta) for beta in BETA], ACCURACY
    )


def test_the_power_behind_the_tables_is_found(found):
    at = found.sel(deborah=1, largest_confinement=0.4)
    assert float(at["collapse_exponent"]) == pytest.approx(POWER, abs=0.02)  # splines between nodes
    inside = at["exponent"].sel(surface_distance=slice(0.05, 0.6))
    np.testing.assert_allclose(inside, POWER, atol=0.05)


def test_velocities_are_those_of_the_law_at_the_same_distance_of_surfaces(found):
    for beta in BETA:
        own = found["relative_velocity"].sel(deborah=1, confinement=beta)
        xi = own["surface_distance"].values
        np.testing.assert_allclose(own, repulsion(1 + xi / beta, beta), rtol=0.02)


def test_distances_are_those_that_all_tables_hold(found):
    xi = found["surface_distance"].values
    assert xi[0] == pytest.approx(0.05 * 0.4)
    assert xi[-1] == pytest.approx(11 * 0.1)


def test_a_reversible_flow_has_no_power(found):
    assert found["collapse_exponent"].sel(deborah=0).isnull().all()
    assert found["exponent"].sel(deborah=0).isnull().all()


def test_the_shortest_ordering_length_and_where(found):
    own = found.sel(deborah=1)
    np.testing.assert_allclose(
        own["shortest_ordering_length"], 10 * np.array(BETA) ** -4.0, rtol=0.01
    )
    gap = (own["shortest_ordering_length_spacing"] - 1) * own["confinement"]
    np.testing.assert_allclose(gap, 0.3, atol=0.02)
    phi = 2 / 3 * own["confinement"] ** 2 / own["shortest_ordering_length_spacing"]
    np.testing.assert_allclose(own["shortest_ordering_length_volume_fraction"], phi)
    none = found.sel(deborah=0)
    assert np.isinf(none["shortest_ordering_length"]).all()
    assert none["shortest_ordering_length_spacing"].isnull().all()


def devices():
    return [xr.Dataset({"channel_diameter": 0.1, "particle_diameter": 0.1 * beta}) for beta in BETA]


def design_map(ordered):
    """Conditions at De = 1, of which one was not simulated."""
    position = [[100.0] * ordered + [np.inf] * (3 - ordered) + [np.nan]]
    return xr.Dataset(
        {"ordered_position": (("deborah", "volume_fraction"), position)}, {"deborah": [1.0]}
    )


def test_every_variable_has_units_and_a_meaning(found):
    for variable in found.variables.values():
        assert {"units", "long_name"} <= set(variable.attrs)


def test_summary_in_words(found):
    maps = [design_map(n) for n in range(3)]
    lines = confinement.summary("mine", found, devices(), maps, SETTINGS)
    text = "\n".join(lines)
    assert "3 diameters of study mine" in text
    assert "  De = 1, d/D 0.1 to 0.4\n    n = 3.90 +- 0.0" in text
    assert "n = 4 within 20 % from 0.02 to 1.1 D, fitted there: 3.90 +- 0.0" in text
    assert "De = 0" not in text
    assert "results/mine/beta0.2/summary.txt" in text
    rows = list(confinement.rows(found, devices(), maps))
    assert [row["d/D"] for row in rows] == ["0.1", "0.2", "0.4"]
    assert [row["d [um]"] for row in rows] == ["10", "20", "40"]
    assert [row["ordered in the map"] for row in rows] == ["0 of 3", "1 of 3", "2 of 3"]
    assert rows[0]["orders along [D]"] == "100000" and rows[0]["[cm]"] == "1000"


def test_without_a_map_nothing_is_said_of_it(found):
    assert {row["ordered in the map"] for row in confinement.rows(found, devices(), [])} == {"-"}
