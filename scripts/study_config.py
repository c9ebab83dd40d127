"""Config of a study with every default written out, and with its fluid where this was fitted.

python scripts/study_config.py --configfile config/config.yaml OUTPUT
"""

from viscotrain import files
from viscotrain.config import stages
from viscotrain.jobs.entry import Job, Result, run


def main(job: Job, result: Result):
    """Write the config as it is now."""
    files.write_text(job.settings.text(), result)


run(main, settings=stages.study_config)
