"""The interactive page and Snakemake's report: what they hold, and that a browser shows them."""

import base64
import hashlib
import itertools
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from harness import output
from synthetic import DEMO_NODES, at_deborah, dns_result, triplet

from viscotrain.drawing import interactive
from viscotrain.fluid.parameters import Fluid, Mode
from viscotrain.fluid.units import physical_units
from viscotrain.table.assembly import combine
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains.repeats import run_repeats
from viscotrain.words import MIDDLE

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
    words = "beyond the quasi-steady range"
    table["memory_number"].loc[{"deborah": 1.0}] = 0.25
    data = data_of(interactive.page(table, UNITS, [train, at_deborah(train, 1e3)], "test"))
    remarks = [layer["remark"] for layer in data["layers"]]
    assert remarks == ["", f"{words}: gaps change by up to 0.25 d in a relaxation time"]
    assert [words in item["name"] for item in data["trains"]] == [False, True]


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
    assert layer["solved"][1][2].startswith("sp = 1.1, sf = 1.5: ")


def test_holes_are_shown_and_not_painted_over():
    data = data_of(interactive.page(velocity_table([(1.5, 2.5)]), UNITS, [], "test"))
    assert data["layers"][0]["surface"] is not None
    layer = data["layers"][1]
    assert layer["surface"] is None
    assert layer["pair"] is None
    assert [point[2] for point in layer["holes"]] == ["sp = 1.5, sf = 2.5: no solution"]
    assert len(layer["solved"]) == 24


def test_tracks_are_those_of_the_trains(train):
    (item,) = data_of(interactive.page(velocity_table(), UNITS, [train], "test"))["trains"]
    np.testing.assert_allclose(item["positions"], train["track_position"], atol=1e-3)
    assert item["name"] == "De = 1, volume fraction 1 %, in the feed 1.65 %"
    assert item["centimetres"][-1] == pytest.approx(0.2)


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
    assert data["columns"][0] == "z [D]" and "CV" in data["columns"]
    assert [row[0] for row in item["statistics"]] == ["0", "10"]
    column = data["columns"].index("CV")
    numbers = item["statistics"][1][column].split(" \N{PLUS-MINUS SIGN} ")
    for end, number in zip(("", "_halfwidth", "_model_error"), numbers, strict=True):
        expected = float(train[f"spacing_variation{end}"][1])
        assert float(number) == pytest.approx(expected, abs=6e-4)
    rate = float(train["injection_rate"]) * 10  # Ubar/D = De/lambda_1 = 10 per second
    assert f"poisson law, {rate:.3g} per second" in item["entry"]
    assert "1 repeat simulated again" in item["entry"]


def opened(path: Path, fragment="") -> tuple[str, list[str]]:
    """The page after its scripts have run, without any network, and what they complained about."""
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr"]
    command += ["--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=8000", "--dump-dom"]
    done = subprocess.run(
        [*command, f"{path.resolve().as_uri()}{fragment}"],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return done.stdout, console


@needs_chromium
@pytest.mark.slow
def test_page_runs_in_a_browser(train, tmp_path):
    path = tmp_path / "page.html"
    text = interactive.page(velocity_table(), UNITS, [train], "test")
    path.write_text(text, encoding="utf-8")
    assert len(text) < 8e6
    shown, console = opened(path, "#deborah=0&station=40")
    assert console == []
    assert shown.count('class="js-plotly-plot"') == 4
    assert "L = 10 D (0.1 cm)" in shown
    assert 'src="http' not in text.split("</script>")[-1]


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
    return interactive.page(table, UNITS, [train.assign_attrs(attributes)], HOSTILE)


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
    assert len(scripts) == 2
    known = [base64.b64encode(hashlib.sha256(own.encode()).digest()).decode() for own in scripts]
    assert rules["script-src"] == " ".join(f"'sha256-{digest}'" for digest in known)
    assert page.index("Content-Security-Policy") < page.index("<script")


@needs_chromium
@pytest.mark.slow
def test_a_browser_runs_no_script_but_those_of_the_page(train, tmp_path):
    """Hostile text is shown as it is; a script that is smuggled in all the same is not run."""
    path = tmp_path / "page.html"
    smuggled = "<script>document.body.id='run'</script></body>"
    for text, complaints in (
        (hostile_page(train), 0),
        (hostile_page(train).replace("</body>", smuggled), 1),
    ):
        path.write_text(text, encoding="utf-8")
        shown, console = opened(path)
        assert len(console) == complaints, console
        assert all("Content Security Policy" in line for line in console)
        assert shown.count('class="js-plotly-plot"') == 4
        assert 'id="run"' not in shown


@needs_chromium
@pytest.mark.slow
def test_report_runs_in_a_browser(project, tmp_path):
    """Of the figures that need no simulation: captions, labels and pictures, without a network."""
    options = ["--cores", "1", "--configfile", "config/tiny.yaml", "--workflow-profile", "none"]
    pictures = [f"results/tiny/figures/{name}.png" for name in ("schematic", "rheology")]
    for more in ([], ["--report", "report.html"]):
        output(project.snakemake(*options, *more, "--", *pictures))
    shown, console = opened(tmp_path / "report.html")
    assert [line for line in console if "tailwindcss" not in line] == []
    assert "Snakemake" in shown
    assert "Study" in shown
    assert "What a rheometer would measure" in (tmp_path / "report.html").read_text("utf-8")
