"""Files are data: nothing that is read is run, no pickle anywhere, and no shell sees a string."""

import ast
from pathlib import Path

import numpy as np
import pytest
from harness import ROOT

SOURCES = sorted((ROOT / "scripts").rglob("*.py"))
RULES = [ROOT / "Snakefile", *sorted((ROOT / "workflow").rglob("*.smk"))]
PICKLING = {
    *("pickle", "_pickle", "cPickle", "dill", "cloudpickle", "joblib", "jsonpickle"),
    *("shelve", "marshal"),
}
# Functions, by their last name, that run what they are given, or build objects of it.
RUNNING = {
    *("eval", "exec", "system", "popen", "getoutput", "getstatusoutput", "__import__"),
    *("read_pickle", "to_pickle", "unsafe_load", "full_load", "load_all", "UnsafeLoader"),
}
SUFFIXES = {
    *(".nc", ".csv", ".yaml", ".txt", ".md", ".html", ".png", ".pdf", ".mp4", ".gif", ".log"),
    *(".vtu", ".snakemake_timestamp"),
}
OF_PICKLES = tuple(bytes([0x80, protocol]) for protocol in range(2, 6))


def named(node: ast.AST) -> str:
    """Last name of what is called or looked up."""
    return getattr(node, "attr", getattr(node, "id", ""))


def offences(tree: ast.AST):
    """What would let a file or a string be code, by line."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names]
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else names
            if PICKLING & {module.split(".")[0] for module in modules}:
                yield node.lineno, f"imports {modules}"
        elif isinstance(node, ast.Call):
            name = named(node.func)
            given = {keyword.arg: keyword.value for keyword in node.keywords}
            if name in RUNNING:
                yield node.lineno, f"calls {name}"
            if "allow_pickle" in given or "shell" in given:
                yield node.lineno, f"{name} with allow_pickle or shell"
            if name == "load" and named(getattr(node.func, "value", node)) == "yaml":
                yield node.lineno, "yaml.load"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_no_source_runs_what_it_reads(path):
    assert list(offences(ast.parse(path.read_text(encoding="utf-8")))) == []


@pytest.mark.parametrize("path", RULES, ids=lambda path: path.name)
def test_no_rule_has_a_shell_command(path):
    """Every rule is a script, which gets strings as Python objects."""
    text = path.read_text(encoding="utf-8")
    for word in ("shell:", "shell(", "run:", "eval(", "exec(", "pickle", "os.system", "subprocess"):
        assert word not in text


@pytest.mark.parametrize(
    "code",
    [
        "import pickle",
        "from joblib import load",
        "import numpy as np\nnp.load(path, allow_pickle=True)",
        "pd.read_pickle(path)",
        "yaml.load(text, Loader)",
        "subprocess.run(command, shell=True)",
        "os.system(command)",
        "eval(text)",
    ],
)
def test_offences_are_found(code):
    assert len(list(offences(ast.parse(code)))) == 1


def test_a_checkpoint_with_a_pickled_object_is_not_opened(tmp_path):
    """What numpy does unless it is told otherwise, which no source does."""
    np.savez(tmp_path / "file.npz", signature=np.array([{}], dtype=object))
    with np.load(tmp_path / "file.npz") as stored, pytest.raises(ValueError, match="pickle"):
        stored["signature"]


@pytest.mark.slow
def test_no_result_is_a_pickle(finished_study):
    files = [path for path in (finished_study / "results").rglob("*") if path.is_file()]
    assert {path.suffix or path.name for path in files} - {".running"} <= SUFFIXES
    assert len(files) > 20
    assert not [path for path in files if Path(path).read_bytes()[:2] in OF_PICKLES]
    for path in files:
        if path.suffix == ".nc":  # netCDF-4, a file of HDF5
            assert path.read_bytes()[:4] == b"\x89HDF" or path.stat().st_size == 0
