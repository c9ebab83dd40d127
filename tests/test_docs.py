"""README and docs: every command and every block of code is run, or says why it is not.

A fenced block says by its language what happens to it: `sh` and `python` are run, in the order of
the page, in a copy of the project; `output`, after one of them, is what it must have printed;
`yaml` must be valid as a part of a config; `text` and `csv` are read only. A comment before a block
changes that:

    <!-- not run: REASON -->    for what takes too long, or changes the machine
    <!-- planned -->            every `snakemake` is a dry run
    <!-- with the demo -->      needs the results of the demo: run if VISCOTRAIN_DEMO names the
                                folder in which it was made
"""

import contextlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
import yaml
from harness import ROOT, SCRIPTS, Project, written
from markdown_it import MarkdownIt

from viscotrain.config.sweep import parse_studies
from viscotrain.errors import ConfigError

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
NAMES = [path.relative_to(ROOT).as_posix() for path in PAGES]
RUN, READ = ("sh", "python"), ("text", "csv")
BUILT = re.compile(r"\{[\w-]+\}")  # directives, which the site runs
MARK = re.compile(r"<!-- (not run: .+|planned|with the demo) -->")
DEMO = os.environ.get("VISCOTRAIN_DEMO", "")


class Block(NamedTuple):
    """A block of code in a page."""

    line: int
    language: str
    text: str
    mark: str

    @property
    def is_run(self) -> bool:
        """Whether something is executed that may print."""
        runs = self.language in RUN and not self.mark.startswith("not run")
        return runs and (bool(DEMO) or self.mark != "with the demo")


def blocks(page: str) -> list[Block]:
    """All blocks of code of a page, each with the comment right before it."""
    tokens = MarkdownIt().parse((ROOT / page).read_text(encoding="utf-8"))
    found = []
    for before, token in zip([None, *tokens], tokens, strict=False):
        if token.type not in ("fence", "code_block"):
            continue
        comment = before.content.strip() if before and before.type == "html_block" else ""
        mark = MARK.search(comment)
        line = token.map[0] + 1
        found.append(Block(line, token.info.strip(), token.content, mark[1] if mark else ""))
    return found


@pytest.mark.parametrize("page", NAMES)
def test_every_block_says_what_it_is(page):
    wrong = [
        f"{page}:{block.line}: a block of {block.language or 'no language'}; allowed: sh, python, "
        "output after one of them, yaml, text, csv"
        for block in blocks(page)
        if not (block.language in (*RUN, *READ, "output", "yaml") or BUILT.match(block.language))
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("page", NAMES)
def test_parts_of_a_config_are_valid(page):
    for block in blocks(page):
        if block.language == "yaml" and not block.mark:
            part = yaml.safe_load(block.text)
            assert is_valid(part), f"{page}:{block.line}"


def is_valid(part: dict) -> bool:
    """Whether the demo's config is valid with them, merged with its sections or in their place."""
    whole = written("config")
    merged = {
        name: whole[name] | section if isinstance(section, dict) and name in whole else section
        for name, section in part.items()
    }
    for config in (whole | merged, whole | part):
        with contextlib.suppress(ConfigError):
            parse_studies(config, source="")
            return True
    return False


@pytest.mark.parametrize("page", NAMES)
def test_links_and_pictures_are_there(page):
    folder = (ROOT / page).parent
    tokens = MarkdownIt().parse((ROOT / page).read_text(encoding="utf-8"))
    inside = [child for token in tokens for child in token.children or []]
    targets = [token.attrGet("href") or token.attrGet("src") for token in inside]
    files = {target.partition("#")[0] for target in targets if target and "://" not in target}
    missing = sorted(name for name in files if not (folder / name).exists())
    assert not missing, f"{page}: no {', '.join(missing)}"


@pytest.mark.slow
@pytest.mark.parametrize("page", [name for name in NAMES if any(b.is_run for b in blocks(name))])
def test_blocks_run_and_print_what_the_page_says(page, tmp_path, monkeypatch):
    folder = copy(tmp_path)
    monkeypatch.chdir(folder)
    names: dict = {}
    printed = None
    for block in blocks(page):
        if block.language == "output":
            if printed is not None:
                assert lines(block.text) == lines(printed), f"{page}:{block.line}"
        elif block.language in RUN:
            printed = run(block, names, f"{page}:{block.line}") if block.is_run else None


def lines(text: str) -> list[str]:
    """Without blanks at the ends, which editors drop."""
    return [line.rstrip() for line in text.strip().splitlines()]


def copy(folder: Path) -> Path:
    """What a clone holds, as far as commands need it, and the results of the demo if there are."""
    Project.copy(folder)
    for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "pyproject.toml"):
        shutil.copy2(ROOT / name, folder)
    if DEMO:
        shutil.copytree(Path(DEMO) / "results" / "demo", folder / "results" / "demo")
        shutil.copytree(Path(DEMO) / ".snakemake", folder / ".snakemake")
    return folder


def run(block: Block, names: dict, place: str) -> str:
    """What a block prints."""
    if block.language == "python":
        with contextlib.redirect_stdout(io.StringIO()) as out:
            exec(compile(block.text, place, "exec"), names)
        return out.getvalue()
    text = block.text
    if block.mark == "planned":
        text = re.sub(r"^snakemake\b", "snakemake --dry-run", text, flags=re.MULTILINE)
    here = {
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "PYTHONPATH": str(SCRIPTS),
        "OPENBLAS_NUM_THREADS": "1",
    }
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", text],
        env=os.environ | here,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, f"{place}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.mark.slow
def test_notebook_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(copy(tmp_path))
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = json.loads((ROOT / "docs" / "notebook.ipynb").read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] for cell in cells)  # what is committed is what is run
    names: dict = {}
    for n, cell in enumerate(cells):
        exec(compile("".join(cell["source"]), f"notebook.ipynb, code cell {n}", "exec"), names)


def test_readme_is_short():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120
