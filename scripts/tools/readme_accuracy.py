"""Take the accuracy statement of the README from the verification of a study.

    python scripts/tools/readme_accuracy.py results/demo/verification

keeps the statement and the numbers behind it in `tests/verification/`, and puts the statement into
README.md between its two markers. Without an argument it puts there what is kept. The same for the
table of `whole_channel.py`.
"""

import argparse
import shutil
from pathlib import Path

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "tests" / "verification"
STATEMENTS = {"accuracy": KEPT / "accuracy.md", "memory": KEPT / "memory" / "outlet.md"}


def main(folder: Path | None, readme: Path):
    """Keep the results of a verification, if there are new ones, and write the README."""
    if folder:
        KEPT.mkdir(exist_ok=True)
        for path in [folder / "accuracy.md", *folder.glob("*.csv")]:
            shutil.copyfile(path, KEPT / path.name)
    readme.write_text(with_statement(readme.read_text(encoding="utf-8")), encoding="utf-8")


def with_statement(text: str) -> str:
    """The text of the README with the kept statements between their markers."""
    for name, path in STATEMENTS.items():
        begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->\n"
        before, _, rest = text.partition(begin)
        _, _, after = rest.partition(end)
        text = f"{before}{begin}\n{path.read_text(encoding='utf-8')}\n{end}{after}"
    return text


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, help="results/<study>/verification")
    main(parser.parse_args().folder, ROOT / "README.md")
