"""Design: which conditions are tried, how they are ranked, and what the answer says."""

import math

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from harness import FINISHED_TABLE, ROOT
from synthetic import BETA, SINGLE, at_deborah, triplet

from viscotrain.drawing import design_page
from viscotrain.fluid.channel import CrossSection
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import design, design_answer, design_conditions, order
from viscotrain.trains.closures import CLOSURES
from viscotrain.trains.design import NO, PARTLY_YES, YES
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.tolerance import Wanted

SQUARE = CrossSection("rectangle", 1.0)


def simulated(phi, passages=30, repeats=2):
    """Short trains of one condition."""
    return run_repeats(
        triplet(),
        confinement=BETA,
        volume_fraction=phi,
        centreline_velocity=1.67,
        length=40.0,
        stations=[0.0, 40.0],
        passages=passages,
        repeats=repeats,
        seed=1,
    )


def test_spacings_and_a_rate_are_volume_fractions():
    own = {"isolated": SINGLE, "confinement": BETA}
    found = design_conditions.volume_fractions([3.0, 4.0], rate=None, section=CrossSection(), **own)
    assert found == pytest.approx([2 / 3 * BETA**2 / 3, 2 / 3 * BETA**2 / 4])
    found = design_conditions.volume_fractions([3.0], rate=None, section=SQUARE, **own)
    assert found == pytest.approx([math.pi / 6 * BETA**2 / 3])
    # the train of this fraction has this rate: one bead per s* d, at U_p
    s = 5.0
    rate = SINGLE / (s * BETA)
    *_, phi = design_conditions.volume_fractions([3.0], rate=rate, section=CrossSection(), **own)
    train = simulated(phi, passages=20, repeats=1)
    assert float(train["injection_rate"]) == pytest.approx(rate, rel=1e-12)
    assert float(train["mean_spacing_law"]) == pytest.approx(s, rel=1e-12)
    for s in (1.4, 100.0):  # closer than the model is good for; too far to feel each other
        (phi,) = design_conditions.volume_fractions(
            [], rate=SINGLE / (s * BETA), section=CrossSection(), **own
        )
        assert math.isnan(phi)


@pytest.mark.parametrize(
    ("variation", "error", "expected"),
    [(0.2, 0.04, YES), (0.2, 0.06, PARTLY_YES), (0.38, 0.01, PARTLY_YES), (0.39, 0.02, NO)],
)
def test_verdict(variation, error, expected):
    assert design.verdict(variation, error, 0.5, 0.25) == expected


def conditions(trains, reasons=()):
    """Numbers of conditions; the n-th is beyond a limit if there is a reason."""
    count = len(trains)
    reasons = list(reasons) + [""] * (count - len(reasons))
    values = {
        "deborah": [float(train["deborah"]) for train in trains],
        "volume_fraction": [float(train["volume_fraction"]) for train in trains],
        "feed_volume_fraction": [1.65 * float(train["volume_fraction"]) for train in trains],
        "sphere_rate": [100.0 * (n + 1) for n in range(count)],
        "memory_number": [0.01] * count,
    }
    names = ("flow_rate", "pressure_drop", "wall_shear_rate", "reynolds_number")
    names += ("elasticity_number", "settling")
    values |= {name: [1.0] * count for name in names}
    data = {name: ("condition", value) for name, value in values.items()}
    return xr.Dataset(data | {"reason": ("condition", reasons)})


def droplets(trains, single):
    count = len(trains)
    shares = np.array([[0.3, own, 0.7 - own] for own in single])
    return xr.Dataset(
        {
            "deborah": ("condition", [float(train["deborah"]) for train in trains]),
            "volume_fraction": ("condition", [float(t["volume_fraction"]) for t in trains]),
            "last_station": ("condition", np.ones(count)),
            "best_single": ("condition", shares[:, 1]),
            "best_single_halfwidth": ("condition", 0 * shares[:, 1] + 0.01),
            "occupancy_halfwidth": (("condition", "count"), 0 * shares + 0.02),
            "poisson_occupancy": (("condition", "count"), 0 * shares + 0.2),
            "best_frequency_ratio": ("condition", np.ones(count)),
            "occupancy": (("condition", "count"), shares),
        }
    )


@pytest.fixture(scope="module")
def trains():
    return [at_deborah(simulated(phi), 1.0) for phi in (0.004, 0.006, 0.01)]


def ranked(trains, reasons=(), single=(0.4, 0.5, 0.6), rate=None, droplet_frequency=None):
    return design.table(
        trains,
        conditions(trains, reasons),
        droplets(trains, single),
        bead_rate=rate,
        droplet_frequency=droplet_frequency,
        ordered_variation=0.25,
    )


def test_rank_is_by_validity_then_rate_then_droplets_or_evenness(trains):
    found = ranked(trains)
    assert found["variation"].is_monotonic_increasing
    best = found["volume_percent"][0]
    first = [float(100 * train["volume_fraction"]) for train in trains].index(best)
    reasons = ["too fast" if n == first else "" for n in range(3)]
    assert ranked(trains, reasons)["reason"].tolist() == ["", "", "too fast"]
    assert ranked(trains, droplet_frequency=10.0)["single_percent"].is_monotonic_decreasing
    matched = ranked(trains, rate=200.0)
    assert matched["has_wanted_rate"].tolist() == [True, False, False]
    assert matched["beads_per_second"][0] == 200
    assert matched["single_percent"][1] > matched["single_percent"][2]


def device(**changes):
    own = {
        "particle": 20.0,
        "channel": 100.0,
        "section": "square duct",
        "wanted": Wanted("every_sphere", "poisson", 40.0, 0.25),
        "variation": 0.02,
        "bead_rate": None,
        "droplet_frequency": None,
    }
    return design_answer.Device(**(own | changes))


def finished(found: pd.DataFrame) -> pd.DataFrame:
    return found.assign(
        ordering_length_D=100.0, variation_by_linear_law=0.3, largest_bead_variation_percent=1.0
    )


def _remedies(found, variation):
    """What the answer says of three devices, one of which helps."""
    others = {"worse": 0.4, design.LONGER: 0.35, "other": 0.29}
    return design_answer.answer(found, [], others, device(variation=variation)).remedies


def test_the_answer_says_what_was_found(trains):
    found = finished(ranked(trains, rate=200.0))
    own = device(bead_rate=200.0)
    answer = design_answer.answer(
        found, ["De = 5: no room"], {"more": 0.1, "less": 0.05}, own, ["a note"]
    )
    text = answer.text()
    assert answer.verdict.startswith(design_answer.VERDICTS[found["forms"][0]])
    assert "Beads of 20 um (variation 2 %) in a square duct, 100 um wide, d/D = 0.2" in text
    assert "0.4 cm long (40 D); wanted: 200 beads/s" in text
    assert f"{found['feed_percent'][0]:.2g} % in the feed, 200 beads/s" in answer.best[0]
    assert "1 cm (100 D), longer than the channel of 0.4 cm" in text
    assert any("beads vary by 2 %" in line and "at most 1 %" in line for line in answer.limits)
    assert "De = 5: no room" in answer.limits
    assert answer.remedies[0] == "less: CV 0.30 -> 0.05, by the linear law"
    assert _remedies(found, 0.02) == [
        "other: CV 0.30 -> 0.29, by the linear law",
        f"{design.LONGER} would not help: CV 0.30 -> 0.35, by the linear law; beads of different "
        "size go on drifting apart",
        "worse would not help: CV 0.30 -> 0.40, by the linear law",
    ]
    assert _remedies(found, 0.0)[1].endswith("by the linear law; it does not order")
    assert "a note" in answer.notes
    beyond = finished(ranked(trains, ["", "too fast"], rate=200.0))
    own = device(bead_rate=200.0)
    words = design_answer.answer(beyond, [], {}, own).verdict
    assert "200 beads/s are reached beyond the limits of validity only, at De = 1" in words
    words = design_answer.answer(finished(ranked(trains, rate=1e4)), [], {}, own).verdict
    assert "beads/s are not reached" in words


def test_remedies_are_those_of_the_linear_law():
    table = VelocityTable.open(ROOT / FINISHED_TABLE)
    wanted = Wanted("every_sphere", "poisson", 800.0, 0.25)
    row = pd.DataFrame([{"deborah": 5.0, "spacing_d": 3.0, "variation_at_inlet": 0.3}])
    best = design.with_linear_law(row, table, wanted, 0.01).iloc[0]
    found, equal = (design.remedies(best, table, wanted, v) for v in (0.01, 0.0))
    longer, even, half, larger = (
        next(name for name in found if word in name)
        for word in ("twice", "evenly", "half", "times as large")
    )
    # 0.264 with neighbours only (matrix exponential of the linear system)
    assert found[even] == pytest.approx(0.26, abs=0.03)
    assert equal[even] == 0 and half not in equal
    # of equal beads: what `order` finds for white noise, in another way
    train = order.response(CLOSURES["every_sphere"](table.at(5.0)), 3.0)
    sigma = order.growth(train, order.WAVE_NUMBERS, 0.2).real
    remains = order.remaining_variation(sigma, train.velocity, 1600.0)
    assert equal[longer] == pytest.approx(0.3 * float(remains), rel=1e-3)
    (alone,) = design.with_linear_law(row, table, wanted, 0.0)["variation_by_linear_law"]
    assert found[half] == pytest.approx(np.hypot(alone, found[even] / 2), rel=1e-9)
    assert found[larger] < best["variation_by_linear_law"]


def test_the_figure_shows_the_answer_and_what_is_not_valid(trains):
    """The best one is named; hollow where not valid; a ring at the rate that is wanted."""
    found = finished(ranked(trains, ["", "too fast"], rate=200.0, droplet_frequency=200.0))
    own = device(bead_rate=200.0, droplet_frequency=200.0)
    figure = design_page.draw_design(found, own).figure
    left, right = figure.axes
    for axes, name in ((left, "variation"), (right, "single_percent")):
        (note,) = [text for text in axes.texts if text.get_text() == "best"]
        assert note.xy == (found["spacing_d"][0], found[name][0])
        hollow = [
            line
            for line in axes.lines
            if str(line.get_markerfacecolor()) == "white" and len(line.get_xdata())
        ]
        (at,) = found.index[found["reason"] == "too fast"]
        assert [line.get_ydata().tolist() for line in hollow] == [[found[name][at]]]
        (ring,) = [
            line for line in axes.lines if line.get_markersize() == 9 and len(line.get_xdata())
        ]
        assert ring.get_ydata().tolist() == found[name][found["has_wanted_rate"]].tolist()
    (bars,) = right.containers
    low, high = bars.lines[2][0].get_segments()[0][:, 1]
    assert high - low == pytest.approx(2 * 2.0)  # 2 % of sampling, no other error is known
    title = figure.get_suptitle()
    assert design_answer.VERDICTS[found["forms"][0]] in title
    for words in ("beads of 20 \N{MICRO SIGN}m, vary by 2 %", "= 40 $D$", "200 droplets/s"):
        assert words in title
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"hollow: beyond a limit of validity", "ring: 200 beads/s, with % in the feed"} < set(
        names
    )
    shares = design.table(
        trains,
        conditions(trains),
        droplets(trains, (0.4, 0.5, 0.6)),
        bead_rate=None,
        droplet_frequency=None,
        ordered_variation=0.25,
    )["single_random_percent"]
    assert shares.tolist() == pytest.approx([100 / math.e] * 3)


def test_the_page_escapes_loads_nothing_and_greys_what_is_not_valid(trains):
    found = finished(ranked(trains, ["<script>alert(1)</script>"]))
    answer = design_answer.answer(found, ["<b>"], {}, device(section="<i>"))
    drawing = design_page.draw_design(found, device())
    page = design_page.page(answer, found, drawing, "<u>", "source & more")
    for tag in ("<script", "<b>", "<i>", "<u>", "http:", "https:"):
        assert tag not in page
    assert "default-src 'none'" in page
    assert page.count('<tr class="invalid">') == 1
    assert page.count("<tr") == 1 + len(found)
    again = design_page.page(answer, found, design_page.draw_design(found, device()), "<u>", "s")
    assert again.split("base64,")[1][:200] == page.split("base64,")[1][:200]
