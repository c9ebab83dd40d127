"""The first page of a study of several diameters: what compares them, and links to their pages."""

import base64
import html
import string
from collections.abc import Mapping, Sequence
from pathlib import Path

TEMPLATE = string.Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
:root { color-scheme: light dark; }
body { font: 15px/1.45 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; }
table { border-collapse: collapse; }
th, td { text-align: right; padding: 0.15em 0.8em; border-bottom: 1px solid #8886; }
.wide { overflow-x: auto; }
img { width: 100%; background: white; }
pre { overflow-x: auto; }
</style>
</head>
<body>
<h1>$title</h1>
<p>Velocities and trains of each diameter, to explore: $links</p>
$table
$figures
<h2>Summary</h2>
<pre>$summary</pre>
</body>
</html>
""")


def page(
    study: str,
    folders: Sequence[str],
    rows: Sequence[Mapping[str, str]],
    figures: Mapping[str, Path],
    summary: str,
) -> str:
    """HTML of the page, with its figures in it.

    Args:
        study: Name.
        folders: Of each diameter, in that of this page.
        rows: Of the table, as text by the name of the column.
        figures: PNG files by their captions.
        summary: Lines of text.
    """
    return TEMPLATE.substitute(
        title=html.escape(f"viscotrain: study {study}"),
        links=", ".join(f'<a href="{name}/interactive.html">{name}</a>' for name in folders),
        table=_table(rows),
        figures="\n".join(_figure(*item) for item in figures.items()),
        summary=html.escape(summary),
    )


def _table(rows: Sequence[Mapping[str, str]]) -> str:
    head = "".join(f"<th>{html.escape(name)}</th>" for name in rows[0])
    body = ["".join(f"<td>{html.escape(text)}</td>" for text in row.values()) for row in rows]
    lines = "\n".join(f"<tr>{cells}</tr>" for cells in (head, *body))
    return f'<div class="wide" tabindex="0"><table>\n{lines}\n</table></div>'


def _figure(caption: str, path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    words = html.escape(caption)
    return f'<h2>{words}</h2>\n<img alt="{words}" src="data:image/png;base64,{data}">'
