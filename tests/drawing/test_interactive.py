"""The interactive page: what it holds, and what it does when it is clicked in a browser."""

import base64
import gzip
import hashlib
import itertools
import json
import math
import re
import shutil
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex
from playwright.sync_api import sync_playwright
from plotly.offline import get_plotlyjs
from synthetic import DEMO_NODES, at_deborah, dns_result, triplet

from viscotrain.drawing import interactive, interactive_data
from viscotrain.drawing.style import MARKERS, NO_ELASTICITY, deborah_look
from viscotrain.fluid.parameters import Fluid, Mode
from viscotrain.fluid.units import physical_units
from viscotrain.table.assembly import combine
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains.order import orders
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.variables import in_digits
from viscotrain.words import INACCURATE, MIDDLE

UNITS = physical_units(Fluid(1.0), {}, channel_diameter=100e-6, particle_diameter=20e-6)
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")


def velocity_table(unsolved=()):
    results = [
        dns_result(sp, sf, unsolved=[1.0] if (sp, sf) in unsolved else [])
        for sp, sf in itertools.product(DEMO_NODES, DEMO_NODES)
    ]
    return combine(
        results, sp=DEMO_NODES, sf=DEMO_NODES, deborah=[0.0, 1.0], max_holes=len(unsolved)
    )


@pytest.fixture(scope="module")
def train():
    result = run_repeats(
        triplet(),
        confinement=0.2,
        volume_fraction=0.01,
        centreline_velocity=1.8,
        length=20.0,
        stations=[0.0, 20.0],
        passages=45,
        repeats=1,
        seed=1,
    )
    return at_deborah(result, 1.0)


def data_of(page: str) -> dict:
    return json.loads(re.search(r"^const data = (.*);$", page, re.MULTILINE)[1])


def test_page_says_that_gaps_change_too_fast(train):
    table = velocity_table()
    words = "beyond the quasi-steady range: stress lags behind the spheres"
    table["memory_number"].loc[{"deborah": 1.0}] = 0.25
    data = data_of(interactive.page(table, UNITS, [train, at_deborah(train, 1e3)], "test"))
    remarks = [layer["remark"] for layer in data["layers"]]
    assert remarks == ["", f"{words}, gaps change by up to 0.25 d in a relaxation time"]
    assert [item["remark"] for item in data["trains"]] == ["", words]


def test_page_holds_the_interpolant_and_the_nodes(train):
    table = velocity_table()
    data = data_of(interactive.page(table, UNITS, [train], "test"))
    layer = data["layers"][1]
    assert [item["name"] for item in data["layers"]] == ["0", "1"]
    row, column = 30, 50  # along sf, along sp
    sp, sf = (1 / (1 - data["grid"][n]) for n in (column, row))
    U = VelocityTable(table).at(1.0)(sp, sf)
    assert layer["surface"][0][row][column] == pytest.approx(U[1] - U[0], rel=1e-3)
    assert layer["surface"][1][row][column] == pytest.approx(U[2] - U[1], rel=1e-3)
    s = 1 / (1 - data["grid"][row])
    velocities = VelocityTable(table).at(1.0)
    pair = velocities(s, np.inf)[MIDDLE] - velocities(np.inf, s)[MIDDLE]
    assert layer["pair"][row] == pytest.approx(pair, rel=1e-3)
    assert len(layer["solved"]) == 25
    assert layer["solved"][-1][:2] == [1.0, 1.0]
    assert layer["solved"][1][2:4] == [1.1, 1.5]
    assert layer["solved"][-1][2:4] == [None, None]
    U = table["velocity"].sel(deborah=1.0, sp=1.1, sf=1.5).values
    assert layer["solved"][1][4:6] == pytest.approx(np.diff(U), rel=1e-3)
    assert (
        10 ** data["power"]
        <= max(item["limit"] for item in data["layers"])
        < 10 ** (data["power"] + 1)
    )


def test_pairs_are_those_of_the_table_in_the_colour_and_with_the_symbol_of_de():
    table = velocity_table()
    table["pair_status"][1, 1] = INACCURATE
    data = data_of(interactive.page(table, UNITS, [], "test"))
    for De, layer in zip((0.0, 1.0), data["layers"], strict=True):
        own = table.sel(deborah=De)
        assert [row[1] for row in layer["pairs"]] == own["pair_distance"].values.tolist()
        U = np.diff(own["pair_velocity"].values, axis=-1)[:, 0]
        np.testing.assert_allclose([row[2] for row in layer["pairs"]], U, rtol=1e-3)
        look = deborah_look(De)
        assert layer["colour"] == to_hex(look["color"])
        assert layer["symbol"] == interactive_data.SYMBOLS[look["marker"]]
    assert [row[4] for row in data["layers"][1]["pairs"]].count(False) == 1


def test_every_marker_of_a_figure_has_a_symbol_on_the_page():
    assert {*MARKERS, NO_ELASTICITY} == set(interactive_data.SYMBOLS)


def test_holes_are_shown_and_not_painted_over():
    table = velocity_table([(1.5, 2.5)])
    data = data_of(interactive.page(table, UNITS, [], "test", ordered(table)))
    assert data["layers"][0]["surface"] is not None
    assert "without a solution: De = 1 (1)." in data["missing"]
    assert data["order"]["deborah"] == ["0", "1"]
    assert None not in data["order"]["stability"][0]
    assert set(data["order"]["stability"][1]) == {None} == set(data["order"]["length"][1])
    layer = data["layers"][1]
    assert layer["surface"] is None
    assert layer["pair"] is None
    assert [point[2:6] for point in layer["holes"]] == [[1.5, 2.5, None, None]]
    assert len(layer["solved"]) == 24


def test_tracks_are_those_of_the_trains(train):
    (item,) = data_of(interactive.page(velocity_table(), UNITS, [train], "test"))["trains"]
    np.testing.assert_allclose(item["positions"], train["track_position"], atol=1e-3)
    assert item["name"] == "De = 1, \N{GREEK SMALL LETTER PHI} = 1 %"
    assert "1 % of the volume in the channel, 1.7 % in the feed" in item["entry"]


def device() -> xr.Dataset:
    """Of a Newtonian fluid of 1 Pa s with a slow mode: Ubar is 1 mm/s at De = 1."""
    fluid = Fluid(0.5, (Mode(0.5, 0.1),))
    return physical_units(
        fluid, {0.0: 0.0, 1.0: 1.0}, channel_diameter=100e-6, particle_diameter=20e-6
    )


def test_the_device_is_that_of_hagen_and_poiseuille(train):
    """At G = 32, dp = 8 mu L Ubar/R^2; flow rate pi R^2 Ubar; spheres enter at phi Q U/Ubar/V."""
    flow = xr.Dataset({"pressure_gradient": ("deborah", [32.0, 32.0])}, {"deborah": [0.0, 1.0]})
    text = interactive.page(velocity_table(), device(), [train], "test", None, flow)
    at_rest, flowing = data_of(text)["layers"]
    assert at_rest["device"] == [] and at_rest["speed"] is None
    R, Ubar, L = 50e-6, 1e-3, 20 * 100e-6
    Q, drop = math.pi * R**2 * Ubar, 8 * 1.0 * L * Ubar / R**2
    rate = float(train["injection_rate"]) * Ubar / (2 * R)
    assert flowing["device"] == [
        f"flow rate {in_digits(Q * 60e9)} \N{MICRO SIGN}L/min",
        "mean velocity 1 mm/s",
        f"pressure drop {in_digits(drop * 1e-5)} bar along 20 D (0.2 cm)",
        f"{in_digits(rate)} spheres per second at 1 %",
    ]
    assert flowing["speed"] == pytest.approx(1e3)  # um/s


def test_errors_are_those_of_the_table(train):
    table = velocity_table()
    nothing = data_of(interactive.page(table, device(), [train], "test"))
    assert [layer["error"] for layer in nothing["layers"]] == [None, None]
    assert set(nothing["trains"][0]["drift"]) == {None}
    error = np.array([[[1e-5, -2e-5]], [[-3e-5, 1e-5]]])
    table["check_error"] = ("deborah", "check", "pair"), error
    data = data_of(interactive.page(table, device(), [train], "test"))
    assert [layer["error"] for layer in data["layers"]] == [2e-5, 3e-5]
    item = data["trains"][0]
    gone = (train["track_time"][:, -1] - train["track_time"][:, 0]).mean()
    assert item["time"][-1] == pytest.approx(float(gone), rel=1e-3)
    # E Ubar along a time t D/Ubar is a length E t D, and D = 5 d
    assert item["drift"][-1] == pytest.approx(5 * 3e-5 * float(gone), rel=1e-3)
    assert item["drift"][0] == 0.0


def test_statistics_are_in_micrometres_too(train):
    item = data_of(interactive.page(velocity_table(), device(), [train], "test"))["trains"][0]
    assert item["columns"][:2] == ["z [D]", "mean spacing [d]"]
    assert item["columns_physical"][:2] == ["z [cm]", "mean spacing [\N{MICRO SIGN}m]"]
    assert [row[0] for row in item["statistics_physical"]] == ["0", "0.2"]
    first, physical = (item[name][1][1] for name in ("statistics", "statistics_physical"))
    mean = float(train["mean_spacing"][1])
    assert first.startswith(f"{mean:.2f}")
    assert physical.startswith(f"{20 * mean:.1f}")


def ordered(table) -> xr.Dataset:
    """As the stage `order` writes it."""
    found = orders(VelocityTable(table), 0.2, spacing=[1.5, 2.0, 3.0, 5.0, 8.0])
    return found.assign(length=20.0)


def test_ordering_lengths_are_those_of_the_order(train):
    table = velocity_table()
    found = ordered(table)
    data = data_of(interactive.page(table, UNITS, [train], "test", found))["order"]
    assert data["deborah"] == ["0", "1"]
    assert data["fraction"] == sorted(data["fraction"])
    assert data["channel"] == 20.0
    for n, s in enumerate(data["spacing"]):
        assert data["fraction"][n] == pytest.approx(100 * 2 / 3 * 0.2**2 / s, rel=1e-3)
        own = found.sel(deborah=1.0, spacing=s)
        assert data["stability"][1][n] == int(own["stability"])
        if math.isfinite(length := float(own["ordering_length"])):
            assert data["length"][1][n] == pytest.approx(length, rel=1e-3)
        else:
            assert data["length"][1][n] is None


def test_statistics_of_a_train_have_both_errors():
    train = run_repeats(
        triplet(),
        confinement=0.2,
        volume_fraction=0.01,
        injection="poisson",
        centreline_velocity=1.8,
        length=10.0,
        stations=[0.0, 10.0],
        passages=45,
        repeats=2,
        seed=1,
    ).assign(deborah=1.0, memory_number=("repeat", [0.0, 0.0]))
    units = physical_units(
        Fluid(0.5, (Mode(0.5, 0.1),)),
        {1.0: 1.0},
        channel_diameter=100e-6,
        particle_diameter=20e-6,
    )
    data = data_of(interactive.page(velocity_table(), units, [train], "test"))
    (item,) = data["trains"]
    assert item["columns"][0] == "z [D]" and "CV" in item["columns"]
    assert [row[0] for row in item["statistics"]] == ["0", "10"]
    column = item["columns"].index("CV")
    numbers = item["statistics"][1][column].split(" \N{PLUS-MINUS SIGN} ")
    for end, number in zip(("", "_halfwidth", "_model_error"), numbers, strict=True):
        expected = float(train[f"spacing_variation{end}"][1])
        last_digit = 10.0 ** -len(number.partition(".")[2])
        if number.startswith("<"):
            assert expected < float(number[1:])
        else:
            assert float(number) == pytest.approx(expected, abs=0.51 * last_digit)
    rate = float(train["injection_rate"]) * 10  # Ubar/D = De/lambda_1 = 10 per second
    assert f"random (Poisson), {in_digits(rate)} spheres per second" in item["entry"]


HOSTILE = (
    "</title></script><script>document.body.id='run'</script><!-- <img src=x onerror=a()> é\u2028"
)


class Elements(HTMLParser):
    """What a browser would make of a page: elements with their attributes, and scripts."""

    def __init__(self, page: str):
        super().__init__()
        self.found: list[tuple[str, dict]] = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


def hostile_page(train) -> str:
    """The page of files whose every text wants to be run."""
    table = velocity_table()
    table.attrs |= {"source": HOSTILE, "history": HOSTILE}
    attributes = dict.fromkeys(train.attrs, HOSTILE)
    units = UNITS.assign_attrs(channel=HOSTILE)
    return interactive.page(table, units, [train.assign_attrs(attributes)], HOSTILE)


def test_no_text_of_a_file_becomes_an_element(train):
    pages = [interactive.page(velocity_table(), UNITS, [train], "test"), hostile_page(train)]
    plain, hostile = (Elements(page).found for page in pages)
    assert [tag for tag, _ in hostile] == [tag for tag, _ in plain]
    assert HOSTILE in data_of(pages[1])["trains"][0]["entry"]
    assert pages[1].count("<script") == pages[0].count("<script")


def test_page_asks_for_nothing_and_its_policy_knows_its_scripts(train):
    page = hostile_page(train)
    elements = Elements(page).found
    asking = {"src", "href", "action", "data", "srcset", "poster", "formaction"}
    assert not [found for found in elements if asking & found[1].keys()]
    assert "@import" not in page.partition("</style>")[0]
    (policy,) = (
        of["content"] for _, of in elements if of.get("http-equiv") == "Content-Security-Policy"
    )
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == "'none'"
    assert "unsafe" not in rules["script-src"]
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    assert len(scripts) == 1
    own = [get_plotlyjs(), *scripts]
    known = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in own]
    assert rules["script-src"] == " ".join(f"'sha256-{digest}'" for digest in known)
    assert page.index("Content-Security-Policy") < page.index("<script")
    packed = re.search(r'<template id="plotly">(.*?)</template>', page)[1]
    assert gzip.decompress(base64.b64decode(packed)).decode() == own[0]


# ------------------------------------------------------------------------------- in a browser


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as session:
        own = session.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield own
        own.close()


class Opened:
    """A page in a tab without a network, and what it complained about."""

    def __init__(self, browser, text: str, path, fragment="", **how):
        path.write_text(text, encoding="utf-8")
        self.context = browser.new_context(offline=True, **how)
        self.tab, self.console = self.context.new_page(), []
        self.tab.set_default_timeout(120e3)
        self.tab.on("console", lambda message: self.console.append(message.text))
        self.tab.on("pageerror", lambda error: self.console.append(str(error)))
        self.clock = self.context.new_cdp_session(self.tab)
        self.clock.send("Performance.enable", {"timeDomain": "threadTicks"})
        self.tab.goto(path.resolve().as_uri() + fragment)
        self.tab.wait_for_selector("html[data-ready=yes]")

    def seconds(self) -> float:
        """Of the main thread's CPU: what a machine that does nothing else would wait for."""
        found = self.clock.send("Performance.getMetrics")["metrics"]
        return {one["name"]: one["value"] for one in found}["TaskDuration"]

    def text(self, selector: str) -> str:
        return self.tab.inner_text(selector)

    def until(self, condition: str):
        """Wait for JavaScript to be true; the policy forbids to have the page do this."""
        for _ in range(200):
            if self.tab.evaluate(condition):
                return
            self.tab.wait_for_timeout(100)
        raise AssertionError(f"never: {condition}")

    def drawn(self, plot: str, what: str):
        return self.tab.evaluate(f"document.getElementById('{plot}').{what}")


def full_page(train) -> str:
    table = velocity_table()
    table["check_error"] = ("deborah", "check", "pair"), np.full((2, 1, 2), 2e-4)
    flow = xr.Dataset({"pressure_gradient": ("deborah", [32.0, 30.0])}, {"deborah": [0.0, 1.0]})
    return interactive.page(table, device(), [train], "test", ordered(table), flow)


@pytest.fixture(scope="module")
def opened(browser, train, tmp_path_factory):
    """The whole page, on a desk and in the light."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    page = Opened(browser, full_page(train), path, "#deborah=1&station=40")
    page.bytes, page.waited = path.stat().st_size, page.seconds()
    page.data = data_of(path.read_text(encoding="utf-8"))
    yield page
    assert page.console == []


@needs_chromium
@pytest.mark.slow
def test_it_is_small_and_opens_at_once(opened):
    assert opened.bytes < 5e6
    assert opened.waited < 2
    assert opened.tab.locator(".js-plotly-plot").count() == 5
    assert "z = 10 D" in opened.text("#where")


@needs_chromium
@pytest.mark.slow
def test_another_de_is_drawn_when_it_is_chosen(opened):
    opened.tab.select_option("#deborah", "0")
    at_rest = opened.drawn("behind", "data[0].z[30][50]")
    assert "No velocity scale" in opened.text("#device")
    opened.tab.select_option("#deborah", "1")
    assert "bar along 20 D" in opened.text("#device")
    flowing = opened.drawn("behind", "data[0].z[30][50]")
    for shown, layer in zip((at_rest, flowing), opened.data["layers"], strict=True):
        factor = 10.0 ** -opened.data["power"]
        assert shown == pytest.approx(factor * layer["surface"][0][30][50])


@needs_chromium
@pytest.mark.slow
def test_maps_are_centred_at_zero_and_hatched_below_the_error(opened):
    """Every cell under the pattern is below the error, in both maps, and there are some."""
    count = 0
    for k, plot in enumerate(("behind", "ahead")):
        assert opened.drawn(plot, "data[0].zmin") == -opened.drawn(plot, "data[0].zmax")
        surface, grid = opened.data["layers"][1]["surface"][k], np.array(opened.data["grid"])
        (pattern,) = [
            one for one in opened.drawn(plot, "data") if one.get("name") == "below the error"
        ]
        assert pattern["fillpattern"]["shape"] == "/"
        for n in range(0, len(pattern["x"]), 6):  # corners of a run of cells, and an end
            left, right = pattern["x"][n : n + 2]
            j = int(np.argmin(np.abs(grid - (pattern["y"][n] + pattern["y"][n + 2]) / 2)))
            for i in np.flatnonzero((grid > left) & (grid < right)):
                assert abs(surface[j][i]) < 2e-4
                assert min(grid[i], grid[j]) >= opened.data["closest"]
                count += 1
    assert count > 20
    factor, said = 10.0 ** -opened.data["power"], opened.text("#error")
    assert f"below the error of the table, {2e-4 * factor:.2g} \N{MULTIPLICATION SIGN} 10" in said


@needs_chromium
@pytest.mark.slow
def test_the_line_of_no_relative_motion_is_where_velocities_change_their_sign(opened):
    (zero,) = [one for one in opened.drawn("behind", "data") if one.get("name") == "zero"]
    assert zero["contours"]["start"] == zero["contours"]["end"] == 0
    near = opened.data["closest"]
    shown = np.array(zero["z"], dtype=float)
    grid = np.array(opened.data["grid"])
    beyond = (grid[:, None] >= near) & (grid >= near)
    surface = np.array(opened.data["layers"][1]["surface"][0], dtype=float)
    there = np.isfinite(shown)
    np.testing.assert_array_equal(shown[there], surface[there])
    assert not there[~beyond].any()
    # where the line may be anywhere in a wide band there is none
    steep = opened.data["widest"] * np.hypot(*np.gradient(surface, grid[1])) > 2e-4
    np.testing.assert_array_equal(there, beyond & steep)
    assert 0 < there.sum() < beyond.sum()


@needs_chromium
@pytest.mark.slow
def test_values_are_read_with_pointer_and_keys(opened):
    tab = opened.tab
    tab.locator("#behind").scroll_into_view_if_needed()
    tab.locator("#behind .nsewdrag").hover()
    opened.until("document.getElementById('behind-value').textContent")
    factor = 10.0 ** -opened.data["power"]
    assert f"\N{PLUS-MINUS SIGN} {2e-4 * factor:.2g}" in opened.text("#behind-value")
    assert "\N{LATIN CAPITAL LETTER U WITH MACRON}" in opened.text("#behind-value")
    tab.focus("#ahead")
    for key in ("Home", "ArrowRight", "ArrowUp"):
        tab.keyboard.press(key)
    n = interactive_data.GRID >> 1
    value = opened.data["layers"][1]["surface"][1][n + 1][1]
    said = opened.text("#ahead-value")
    assert said.startswith("sp = 1.01 d")
    shown = float(re.search(r": (\S+) \N{PLUS-MINUS SIGN}", said)[1])
    assert shown == pytest.approx(value * factor, abs=0.06 * 2e-4 * factor)
    opened.until("document.querySelectorAll('#ahead .hovertext').length === 1")


@needs_chromium
@pytest.mark.slow
def test_micrometres_and_seconds_are_a_switch(opened):
    tab = opened.tab
    before = opened.drawn("behind", "data[0].z[30][50]")
    tab.check("#physical")
    assert "[\N{MICRO SIGN}m]" in opened.drawn("behind", "layout.xaxis.title.text")
    assert opened.drawn("behind", "data[0].z[30][50]") == pytest.approx(
        1e3 * before * 10.0 ** opened.data["power"]
    )
    names = {one["name"] for one in opened.drawn("pair", "data")}
    assert names == {"De = 1", "error"}  # De = 0 has no velocity in um/s
    tab.select_option("#deborah", "0")
    assert "velocities stay in 10" in opened.text("#device")
    tab.select_option("#deborah", "1")
    assert opened.text("#statistics th >> nth=0") == "z [cm]"
    seconds = opened.data["trains"][0]["time"][40] * 0.1  # D/Ubar is 0.1 s
    assert f"z = 0.1 cm, {seconds:.3g} s after the entry" in opened.text("#where")
    tab.uncheck("#physical")
    assert opened.text("#statistics th >> nth=0") == "z [D]"


@needs_chromium
@pytest.mark.slow
def test_a_click_on_the_ordering_map_chooses_its_de(opened):
    tab = opened.tab
    tab.locator("#order").scroll_into_view_if_needed()
    assert opened.drawn("order", "data[0].zmin") == -1  # a tenth of the channel's length
    lengths = np.array(opened.data["order"]["length"], dtype=float)
    stable = np.array(opened.data["order"]["stability"]) > 0
    shown = np.array(opened.drawn("order", "data[0].z"), dtype=float)
    np.testing.assert_allclose(shown[stable], np.log10(lengths / 20.0)[stable], rtol=1e-6)
    assert np.isnan(shown[~stable]).all()
    (dotted,) = [one for one in opened.drawn("order", "data") if one.get("name") == "unstable"]
    assert dotted["fillpattern"]["shape"] == "."
    assert "1 = L" in opened.drawn("order", "data[0].colorbar.ticktext.join()")
    assert "L = 20 D" in opened.drawn("order", "data[0].colorbar.title.text")
    for share, De in ((0.25, "0"), (0.75, "1")):  # rows from above
        box = tab.locator("#order .nsewdrag").bounding_box()
        tab.mouse.click(box["x"] + box["width"] / 2, box["y"] + share * box["height"])
        opened.until(f"document.getElementById('deborah').value === '{De}'")
    tab.focus("#order")
    tab.keyboard.press("PageUp")
    assert "De = 0, volume fraction" in opened.text("#order-value")
    tab.keyboard.press("Enter")
    assert tab.input_value("#deborah") == "0"
    tab.keyboard.press("ArrowDown")
    assert "De = 1, volume fraction" in opened.text("#order-value")
    tab.keyboard.press("Enter")
    assert tab.input_value("#deborah") == "1"


@needs_chromium
@pytest.mark.slow
def test_a_train_is_a_map_of_its_distances(opened, train):
    s = -np.diff(train["track_position"].values, axis=0)
    law = float(train["mean_spacing_law"])
    ratio = np.log(np.maximum(s, 1) / law)
    ratio /= np.where(s < law, np.log(law), np.log(s.max() / law))  # from contact to the widest
    shown = np.array(opened.drawn("rows", "data[0].z"), dtype=float)
    touching = s < 1.1
    np.testing.assert_array_equal(np.isnan(shown), touching)
    np.testing.assert_allclose(shown[~touching], ratio[~touching], atol=5e-3)
    opened.tab.select_option("#shown", "change")
    change = np.array(opened.drawn("rows", "data[0].z"), dtype=float)
    np.testing.assert_allclose(change, s - s[:, :1], atol=3e-3)
    assert opened.drawn("rows", "data[0].zmin") == -opened.drawn("rows", "data[0].zmax")
    assert "Hatched" in opened.text("#legend")
    opened.tab.select_option("#shown", "spacing")


COLUMNS = """() => {
  const canvas = document.getElementById("film"), pen = canvas.getContext("2d");
  const { data } = pen.getImageData(0, 0, canvas.width, canvas.height), found = [];
  const blue = (k) => data[k] === 0 && data[k + 1] === 114 && data[k + 2] === 178;
  const orange = (k) => data[k] === 213 && data[k + 1] === 94 && data[k + 2] === 0;
  for (let x = 0; x < canvas.width; x += 1) {
    let length = 0;
    for (let y = 0; y < canvas.height; y += 1) {
      const k = 4 * (y * canvas.width + x);
      length = blue(k) || orange(k) ? length + 1 : 0;
      found.push(length);
    }
  }
  return found.reduce((one, other) => Math.max(one, other), 0);
}"""


@needs_chromium
@pytest.mark.slow
def test_the_film_plays_and_is_to_scale(opened, train):
    tab = opened.tab
    tab.locator("#station").fill("0")
    tab.click("#play")
    assert opened.text("#play") == "pause"
    opened.until("document.getElementById('station').value > 2")
    tab.focus("#play")
    tab.keyboard.press("Enter")
    assert opened.text("#play") == "play"
    stopped = tab.input_value("#station")
    tab.wait_for_timeout(300)
    assert tab.input_value("#station") == stopped
    tab.focus("#station")
    tab.keyboard.press("ArrowRight")
    assert int(tab.input_value("#station")) == int(stopped) + 1
    assert (
        opened.drawn("rows", "data[1].x[0]")
        == (opened.data["trains"][0]["stations"][int(stopped) + 1])
    )
    largest = tab.evaluate(COLUMNS)
    width = tab.evaluate("document.getElementById('film').width")
    x = train["track_position"].values
    length = x.max() - x.min() + 2
    rows = max(1, math.ceil(length * 9 / width))
    assert largest == pytest.approx(width * rows / length, abs=2)


@needs_chromium
@pytest.mark.slow
def test_on_a_phone_in_the_dark(browser, train, tmp_path):
    phone = {"viewport": {"width": 360, "height": 740}, "has_touch": True}
    page = Opened(browser, full_page(train), tmp_path / "page.html", color_scheme="dark", **phone)
    assert page.tab.evaluate("document.documentElement.scrollWidth") <= 360
    assert page.tab.evaluate("getComputedStyle(document.body).backgroundColor") == (
        "rgb(22, 24, 28)"
    )
    assert page.drawn("behind", "layout.font.color") == "#e6e6e6"
    for plot in ("behind", "pair", "order"):
        assert page.drawn(plot, "layout.plot_bgcolor") == "#1d2026"
    assert page.drawn("behind", "data[0].colorscale[2][1]") == interactive_data.DARK_SIGNED[2]
    box = page.tab.locator("#statistics").bounding_box()
    assert box["width"] <= 360
    names = page.tab.evaluate(
        "[...document.querySelectorAll('#statistics tr:nth-child(2) td')].map((td) => "
        "getComputedStyle(td, '::before').content)"
    )
    assert names[0] == '"z [D]"' and '"CV"' in names
    assert page.tab.locator("#train").bounding_box()["width"] < 340
    page.tab.locator("#behind .nsewdrag").tap()
    page.until("document.getElementById('behind-value').textContent")
    assert "\N{LATIN CAPITAL LETTER U WITH MACRON}" in page.text("#behind-value")
    page.tab.emulate_media(color_scheme="light")
    page.until("document.getElementById('behind').layout.font.color === '#222'")
    assert page.console == []


@needs_chromium
@pytest.mark.slow
def test_a_de_without_a_train_and_a_table_with_holes_are_said(browser, train, tmp_path):
    """The train stays that of its own De, whatever De is chosen; what is not known is said."""
    table = velocity_table([(1.5, 2.5)])
    found = ordered(table)
    found["stability"].loc[{"deborah": 0}], found["ordering_length"].loc[{"deborah": 0}] = (
        0,
        math.inf,
    )
    text = interactive.page(table, device(), [train], "test", found)
    page = Opened(browser, text, tmp_path / "page.html", "#deborah=0")
    assert "De = 1 (1)" in page.text("#missing")
    assert "No train in this study is at De = 0; this one is at De = 1." in page.text("#other")
    titles = page.tab.locator("h2").all_inner_texts()
    assert titles[0].startswith("Three spheres at De = 0:")
    assert titles[3:] == [
        f"{what} at De = 1" for what in ("A train", "Film of the train", "Statistics of the train")
    ]
    notes = [note["text"] for note in page.drawn("order", "layout.annotations")]
    assert notes == [
        "reversible: neither orders nor gets less even",
        "not known: the table has holes",
    ]
    page.tab.select_option("#deborah", "1")
    assert page.text("#other") == ""
    page.tab.locator("#behind .nsewdrag").click()
    page.until("document.getElementById('behind-value').textContent.includes('no interpolant')")
    assert page.console == []


@needs_chromium
@pytest.mark.slow
def test_the_train_is_that_of_the_de_that_is_chosen(browser, train, tmp_path):
    trains = [at_deborah(train, De) for De in (0.0, 1.0)]
    text = interactive.page(velocity_table(), device(), trains, "test")
    page = Opened(browser, text, tmp_path / "page.html")
    for De in ("1", "0"):
        page.tab.select_option("#deborah", De)
        assert page.tab.input_value("#train") == De
        assert page.text("h2 >> nth=3") == f"A train at De = {De}"
        assert page.text("#other") == ""
    page.tab.select_option("#train", "1")
    assert page.text("#other").startswith("Above, De = 0 is chosen; this one is at De = 1.")
    assert page.console == []


@needs_chromium
@pytest.mark.slow
def test_a_browser_runs_no_script_but_those_of_the_page(browser, train, tmp_path):
    """Hostile text is shown as it is; a script that is smuggled in all the same is not run."""
    smuggled = "<script>document.body.id='run'</script></body>"
    text = hostile_page(train).replace("</body>", smuggled)
    page = Opened(browser, text, tmp_path / "page.html")
    (complaint,) = page.console
    assert "Content Security Policy" in complaint
    assert page.tab.locator(".js-plotly-plot").count() >= 4
    assert page.tab.locator("#run").count() == 0
    assert HOSTILE.replace("\u2028", "") in page.text("h1").replace("\u2028", "")
