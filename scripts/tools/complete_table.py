r"""Add to a finished velocity table how velocities change with the diameter, if it lacks that.

The single spheres are those of the dns stage, of the study that made the table:

snakemake results/paper/dns/spinf_sfinf_d{0.9,0.95,1.05,1.1}.nc \
    --cores 2 --configfile config/paper.yaml
python scripts/tools/complete_table.py docs/study/velocity_table.nc \
    results/paper/dns/spinf_sfinf_d*.nc
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from viscotrain.jobs import agreement, datasets, provenance
from viscotrain.table.description import summary
from viscotrain.table.size_response import with_size_response


def main(path: Path, files: Sequence[Path]):
    """Check that table and spheres are of the same fluid, and write the table again."""
    table, spheres = datasets.read(path), {str(file): datasets.read(file) for file in files}
    code = agreement.refuse_other_spheres(table, spheres)
    completed = with_size_response(table, list(spheres.values())).assign_attrs(code)
    made = f"single spheres added by viscotrain at commit {provenance.git_commit()}"
    before = completed.attrs["history"].partition("; single spheres")[0]
    datasets.write(completed.assign_attrs(history=f"{before}; {made}"), path)
    print(summary(completed))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("table", type=Path, help="velocity_table.nc, which is written again")
    parser.add_argument("spheres", type=Path, nargs="+", help="files of the dns stage")
    given = parser.parse_args()
    main(given.table, given.spheres)
