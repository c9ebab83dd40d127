"""Draw which rule of the workflow uses what of which: docs/rules.svg, from Snakemake's own graph.

    python scripts/tools/generate_rule_graph.py

An arrow that others imply is left out: `summary` reads the table, but trains, which it reads as
well, come from it. `--check` writes nothing and exits with 1 when the drawing is out of step.
"""

import argparse
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from html import escape
from itertools import pairwise
from pathlib import Path

from marked_blocks import write

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "rules.svg"
CONFIG = "config/config.yaml"
WIDTH, HEIGHT, ACROSS, DOWN = 132, 30, 172, 52  # of a box, and from one to the next
MARGIN, SWEEPS = 20, 8

Graph = dict[str, set[str]]  # what each rule uses
Layers = list[list[str]]

STYLE = """\
<style>
.box { fill: #e8f1f8; stroke: #0072b2; stroke-width: 1.5 }
.arrow { fill: none; stroke: #666; stroke-width: 1.3; marker-end: url(#head) }
text { font: 13px sans-serif; text-anchor: middle; fill: #111 }
</style>
<marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7"
 orient="auto"><path d="M0,0 L8,4 L0,8 z" fill="#666"/></marker>"""


def main(check: bool):
    """Draw the graph of the demo."""
    picture = drawing(reduced(rules(CONFIG)))
    if not PICTURE.exists():
        PICTURE.touch()
    write({PICTURE: picture}, check, "python scripts/tools/generate_rule_graph.py")


def rules(config: str) -> Graph:
    """What each rule uses, as Snakemake has it; numbered ones, one a job, are one."""
    command = [sys.executable, "-m", "snakemake", "--rulegraph", "mermaid-js"]
    done = subprocess.run(
        [*command, "--configfile", config], cwd=ROOT, capture_output=True, text=True, check=True
    )
    names = dict(re.findall(r"^\s*(id\d+)\[(\w+?)(?:_\d+)?\]", done.stdout, re.MULTILINE))
    graph: Graph = {name: set() for name in names.values()}
    for source, target in re.findall(r"^\s*(id\d+) --> (id\d+)", done.stdout, re.MULTILINE):
        graph[names[target]].add(names[source])
    return graph


def reduced(graph: Graph) -> Graph:
    """Without the arrows that others imply."""
    return {
        rule: {use for use in uses if not any(use in behind(graph, other) for other in uses)}
        for rule, uses in graph.items()
    }


def behind(graph: Graph, rule: str) -> set[str]:
    """All that a rule rests on."""
    return graph[rule].union(*(behind(graph, use) for use in graph[rule]))


def drawing(graph: Graph) -> str:
    """An SVG picture, from left to right."""
    ways = {
        (use, rule): [use, *(f"{use} {rule} {n}" for n in between(graph, use, rule)), rule]
        for rule in sorted(graph)
        for use in sorted(graph[rule])
    }
    layers = arranged(graph, ways.values())
    place = {
        name: (MARGIN + ACROSS * column, _top(layers, column) + DOWN * row)
        for column, layer in enumerate(layers)
        for row, name in enumerate(layer)
    }
    width = 2 * MARGIN + ACROSS * (len(layers) - 1) + WIDTH
    height = 2 * MARGIN + DOWN * (max(map(len, layers)) - 1) + HEIGHT
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">',
        STYLE,
        f'<rect width="{width}" height="{height}" fill="white"/>',
        *(arrow([place[name] for name in way]) for way in ways.values()),
        *(box(name, *place[name]) for name in sorted(graph)),
        "</svg>\n",
    ]
    return "\n".join(parts)


def depth(graph: Graph, rule: str) -> int:
    """Number of the layer of a rule: right of all that it uses, or left of its first user."""
    if graph[rule]:
        return 1 + max(_steps(graph, use) for use in graph[rule])
    return min((_steps(graph, user) for user in graph if rule in graph[user]), default=1) - 1


def _steps(graph: Graph, rule: str) -> int:
    """Most rules that come before one."""
    return 1 + max((_steps(graph, use) for use in graph[rule]), default=-1)


def between(graph: Graph, use: str, rule: str) -> range:
    """Layers that an arrow crosses."""
    return range(depth(graph, use) + 1, depth(graph, rule))


def arranged(graph: Graph, ways: Iterable[list[str]]) -> Layers:
    """Layers of boxes, and of places where arrows pass, so that few arrows cross."""
    layers: Layers = [[] for _ in range(1 + max(depth(graph, rule) for rule in graph))]
    for rule in sorted(graph):
        layers[depth(graph, rule)].append(rule)
    neighbours: dict[str, set[str]] = {rule: set() for rule in graph}
    for way in ways:
        first = depth(graph, way[0])
        for n, name in enumerate(way[1:-1], start=1):
            layers[first + n].append(name)
        for one, other in pairwise(way):
            neighbours.setdefault(one, set()).add(other)
            neighbours.setdefault(other, set()).add(one)
    for sweep in range(SWEEPS):
        for layer in layers if sweep % 2 else reversed(layers):
            layer.sort(key=lambda name: _middle(name, neighbours, layers))
    return layers


def _middle(name: str, neighbours: Mapping[str, set[str]], layers: Layers) -> float:
    """Mean height of what a name is joined to."""
    height = {
        other: (row - (len(layer) - 1) / 2) for layer in layers for row, other in enumerate(layer)
    }
    joined = [height[other] for other in neighbours[name]]
    return sum(joined) / len(joined) if joined else height[name]


def _top(layers: Layers, column: int) -> int:
    """Where a layer begins, so that all have one middle."""
    return MARGIN + DOWN * (max(map(len, layers)) - len(layers[column])) // 2


def arrow(places: list[tuple[int, int]]) -> str:
    """A smooth line through places, from the right of the first box to the left of the last."""
    middle = HEIGHT // 2
    x, y = places[0][0] + WIDTH, places[0][1] + middle
    path = [f"M{x},{y}"]
    for n, (left, top) in enumerate(places[1:], start=1):
        half = (left - x) // 2
        path.append(f"C{x + half},{y} {x + half},{top + middle} {left},{top + middle}")
        x, y = left, top + middle
        if n < len(places) - 1:
            x += WIDTH
            path.append(f"L{x},{y}")
    return f'<path class="arrow" d="{" ".join(path)}"/>'


def box(name: str, x: int, y: int) -> str:
    """A rule."""
    return (
        f'<rect class="box" x="{x}" y="{y}" width="{WIDTH}" height="{HEIGHT}" rx="6"/>\n'
        f'<text x="{x + WIDTH // 2}" y="{y + HEIGHT // 2 + 5}">{escape(name)}</text>'
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare only, write nothing")
    main(parser.parse_args().check)
