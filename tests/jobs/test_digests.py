"""Digests of code: what changes them, and which rules a change of a module repeats."""

import ast
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from viscotrain.jobs import digests

ROOT = Path(__file__).parents[2]
RULES = sorted((ROOT / "workflow" / "rules").glob("*.smk"))
SCRIPT = re.compile(r'"\.\./\.\./scripts/(\w+)\.py"')
CODE = '''"""Title."""
import math

def area(radius):
    """Words."""
    return math.pi * radius**2
'''


@pytest.fixture
def tree(tmp_path) -> Path:
    """A copy of the scripts, with the package."""
    ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
    return Path(shutil.copytree(ROOT / "scripts", tmp_path / "scripts", ignore=ignored))


def rules() -> list[tuple[str, str]]:
    """Name and text of every rule, variants included."""
    found = []
    for path in RULES:
        parts = re.split(r"^ *(?:use )?rule ", path.read_text(encoding="utf-8"), flags=re.M)[1:]
        found += [(re.match(r"(?:\w+ as )?(\w+)", part)[1], part) for part in parts]
    return found


def scripts() -> set[str]:
    return {match for _, text in rules() for match in SCRIPT.findall(text)}


def all_digests(tree: Path) -> dict[str, str]:
    """Of all scripts that rules call, in a tree that may have changed since."""
    digests._imports.cache_clear()
    digests._digest.cache_clear()
    package = tree / "viscotrain"
    return {name: digests._digest(tree / f"{name}.py", package) for name in scripts()}


def with_another_body(path: Path):
    """Change the body of a function of a module, or of its first one that has any code."""
    code = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(code) if isinstance(node, ast.FunctionDef)]
    (functions[0].body if functions else code.body).append(ast.parse("CHANGED = 1").body[0])
    path.write_text(ast.unparse(code), encoding="utf-8")


# ------------------------------------------------------------------------------- one file's text


def digest_of(folder: Path, code: str) -> str:
    (folder / "job.py").write_text(code, encoding="utf-8")
    digests._digest.cache_clear()
    return digests.digest(folder / "job.py")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""Title."""', '"""Another title."""'),
        ('    """Words."""\n', '    """Other\n    words."""\n'),
        ('    """Words."""\n', ""),
        ("import math\n", "import math  # for pi\n\n# A comment.\n"),
        ("math.pi * radius**2", "(math.pi * (radius ** 2))"),
    ],
    ids=["module docstring", "function docstring", "no docstring", "comments", "layout"],
)
def test_digest_ignores_text(old, new, tmp_path):
    assert old in CODE
    assert digest_of(tmp_path, CODE.replace(old, new)) == digest_of(tmp_path, CODE)


@pytest.mark.parametrize(
    ("old", "new"),
    [("radius**2", "radius**3"), ("math.pi *", "-math.pi *"), ("(radius):", "(radius=1.0):")],
)
def test_digest_follows_code(old, new, tmp_path):
    assert old in CODE
    assert digest_of(tmp_path, CODE.replace(old, new)) != digest_of(tmp_path, CODE)


# What syntax trees of different versions of Python say differently: type parameters, empty lists,
# None, and the end of a width in a formatted text.
ODD = """
@property
def words(self, *, width=None) -> str:
    global known
    return f"{known()!r:>{width}} {self:.{width}g} {f''}", ""
"""


@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13", "3.14"])
def test_digest_is_the_same_for_every_python(version, tmp_path):
    python = f"python{version}"
    if not shutil.which(python) or subprocess.run([python, "--version"], check=False).returncode:
        pytest.skip(f"no {python} here")
    (tmp_path / "job.py").write_text(ODD, encoding="utf-8")
    code = "import runpy, sys; print(runpy.run_path(sys.argv[1])['digest'](sys.argv[2]))"
    command = [python, "-c", code, digests.__file__, tmp_path / "job.py"]
    found = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    assert found == digest_of(tmp_path, ODD) == "e3f8d8c2283bfac3"


# ----------------------------------------------------------------------------- scripts and modules


def test_imports_inside_functions_are_reached(tmp_path):
    script = tmp_path / "job.py"
    script.write_text(
        "def main():\n    from viscotrain.trains import films\n    import viscotrain.flow.newton\n",
        encoding="utf-8",
    )
    found = digests.reached(script)
    assert {"trains.films", "flow.newton", "trains.motion"} <= found


def test_numbers_of_the_simulation_are_reached():
    found = digests.reached(ROOT / "scripts" / "dns.py")
    assert {"flow.meshes", "flow.weak_forms", "fluid.pipe", "studies.dns", "words"} <= found
    assert "config.settings" in found
    assert not {"table.assembly", "trains.motion", "studies.transient"} & found
    direct = digests.reached(ROOT / "scripts" / "closure_train.py")
    assert "flow.time_stepping" in direct
    assert not {"table.interpolation", "trains.motion"} & direct
    compared = digests.reached(ROOT / "scripts" / "verification_report.py")
    assert {"trains.motion", "table.lubrication"} <= compared


def test_what_is_left_out_exists_and_decides_no_number():
    package = ROOT / "scripts" / "viscotrain"
    for name in digests.WITHOUT_NUMBERS | digests.NUMBERS_AFTER_ALL:
        path = package.joinpath(*name.split("."))
        assert path.is_dir() or path.with_suffix(".py").is_file(), name
    assert {"words", "fluid", "flow", "trains"}.isdisjoint(digests.WITHOUT_NUMBERS)


def test_changing_any_module_changes_the_digests_of_the_scripts_that_reach_it(tree):
    package = tree / "viscotrain"
    before = all_digests(tree)
    modules = [path for path in package.rglob("*.py") if path.name != "__init__.py"]
    assert len(modules) > 40
    for path in modules:
        name = ".".join(path.relative_to(package).with_suffix("").parts)
        reaching = {s for s in before if name in digests.reached(tree / f"{s}.py", package)}
        original = path.read_text(encoding="utf-8")
        with_another_body(path)
        after = all_digests(tree)
        path.write_text(original, encoding="utf-8")
        assert {script for script in before if before[script] != after[script]} == reaching, name


# ----------------------------------------------------------------------------------------- rules


def test_every_rule_with_a_script_has_the_digest_of_it():
    """A variant has that of the rule it varies, unless it has parameters of its own."""
    own = {name: SCRIPT.findall(text) for name, text in rules()}
    bases = {}
    for path in RULES:
        text = path.read_text(encoding="utf-8")
        bases |= {new: old for old, new in re.findall(r"^use rule (\w+) as (\w+)", text, re.M)}
    checked = 0
    for name, text in rules():
        script = own[name] or own.get(bases.get(name), [])
        if script:
            given = re.findall(r'\*\*given\(\s*"(\w+)"', text)
            assert given == script or (name in bases and not given and "params:" not in text), name
            checked += 1
    assert checked >= 18


def test_no_rule_file_makes_a_name_that_another_could_use():
    """Names are made in common.smk alone, so the order of the others does not matter.

    Or they begin with that of the file, as those of a loop over rules.
    """
    for path in RULES:
        own = rf"(?!(?:for )?{path.stem.upper()}_)"
        makes = re.compile(rf"^ *{own}(?:\w+ *=[^=]|def |import |from |class |for |with )")
        inside = 0  # of brackets, where name = value is an argument
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            if path.name != "common.smk" and not inside and not line.startswith(" " * 8):
                assert not makes.match(line), f"{path.name}:{number}: {line}"
            inside += sum(map(line.count, "([{")) - sum(map(line.count, ")]}"))
    snakefile = (ROOT / "Snakefile").read_text(encoding="utf-8")
    included = re.findall(r'^ *include: "workflow/rules/(\w+)\.smk"', snakefile, re.M)
    assert included[0] == "common"
    assert {f"{name}.smk" for name in included} == {path.name for path in RULES}


def test_scripts_have_no_plumbing_of_their_own():
    for name in scripts():
        text = (ROOT / "scripts" / f"{name}.py").read_text(encoding="utf-8")
        assert "snakemake" not in text and "noqa" not in text, name
        assert text.count("\n") < 65, name
