"""Verification stage by hand: one comparison or study of convergence, by its name.

Each with --configfile config/config.yaml and an OUTPUT; `--help` after the name says more:

python scripts/verification.py start_up TRAJECTORY
python scripts/verification.py closure_train --deborah 5
python scripts/verification.py closure_gap --gap 0.5
python scripts/verification.py convergence --kind mesh --sp 1.5 --sf 2.5
"""

import runpy
import sys
from pathlib import Path

WORK = ("start_up", "closure_train", "closure_gap", "convergence")

if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in WORK:
        sys.exit(__doc__)
    script = Path(__file__).with_name(f"{sys.argv.pop(1)}.py")
    runpy.run_path(str(script), run_name="__main__")
