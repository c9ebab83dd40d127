"""Config of a study with every default written out, and with its fluid where this was fitted.

python scripts/study_config.py --configfile config/config.yaml OUTPUT
"""

from pathlib import Path

from viscotrain.jobs.entry import Job, made, run


def main(job: Job, written: Path):
    """Write the config as it is now, which loads to the same study."""
    written.parent.mkdir(parents=True, exist_ok=True)
    written.write_text(job.whole_study().resolved_yaml(), encoding="utf-8")


run(main, config=True, arguments=[made("written", "YAML file to write", key="config")])
