"""One page to explore a study: any De, any train, in a browser, without a network.

The page asks nothing of a network, and its content security policy says so: a browser runs the two
scripts that the page holds, known by their hashes, and loads nothing. All text from a file is
escaped. The page holds plotly's JavaScript, packed, and what it shows (`interactive_data`) as JSON.
"""

import base64
import gzip
import hashlib
import html
import json
import re
import string
from collections.abc import Sequence
from pathlib import Path

import xarray as xr
from plotly.offline import get_plotlyjs

from viscotrain.drawing.interactive_data import MICRO, page_data
from viscotrain.fluid.units import MICROMETRES

POLICY_PLACE = "(policy)"  # until the scripts are known
SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
TEMPLATE = Path(__file__).with_suffix(".html")


class _Page(string.Template):
    """The template; its placeholders do not look like those of JavaScript."""

    delimiter = "@@"


def page(
    table: xr.Dataset,
    units: xr.Dataset,
    trains: Sequence[xr.Dataset],
    study: str,
    order: xr.Dataset | None = None,
    flow: xr.Dataset | None = None,
) -> str:
    """HTML of the page.

    Args:
        table: The velocity table.
        units: Result of `units.physical_units`.
        trains: As `repeats.run_repeats` returns them.
        study: Its name.
        order: Result of the stage `order`; None for a page without ordering lengths.
        flow: Without spheres, of the stage `channel_flow`; None for one without pressures.
    """
    library = get_plotlyjs()
    data = page_data(table, units, trains, order, flow)
    text = _Page(TEMPLATE.read_text(encoding="utf-8")).substitute(
        policy=POLICY_PLACE,
        title=html.escape(f"viscotrain: study {study}"),
        plotly=base64.b64encode(gzip.compress(library.encode(), mtime=0)).decode(),
        particle=_micrometres(units["particle_diameter"]),
        channel=_channel(units),
        source=html.escape(_source(table)),
        data=json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
    )
    return text.replace(POLICY_PLACE, _policy([library, *SCRIPT.findall(text)]), 1)


def _policy(own: Sequence[str]) -> str:
    """Content security policy of a page: its own scripts and styles, and nothing from elsewhere."""
    digests = (hashlib.sha256(script.encode()).digest() for script in own)
    scripts = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    rules = ["default-src 'none'", f"script-src {scripts}", "style-src 'unsafe-inline'"]
    return "; ".join([*rules, "img-src data:", "base-uri 'none'", "form-action 'none'"])


def _source(table: xr.Dataset) -> str:
    """Of which program the table is."""
    source = table.attrs.get("source", "").removeprefix("viscotrain, ")
    return f"{source}; {table.attrs.get('history', '')}"


def _micrometres(diameter: xr.DataArray) -> str:
    """A diameter in words."""
    return f"{MICROMETRES * float(diameter):.3g} {MICRO}m"


def _channel(units: xr.Dataset) -> str:
    """The channel's diameter, and what must be said of a duct."""
    remark = units.attrs.get("channel")
    return _micrometres(units["channel_diameter"]) + (f" ({html.escape(remark)})" if remark else "")
