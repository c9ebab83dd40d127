"""viscotrain: from a fluid, a channel and a particle to verified velocities, trains and figures."""

import sys

sys.path.insert(0, f"{workflow.basedir}/scripts")

from snakemake.exceptions import WorkflowError

from viscotrain.jobs import provenance
from viscotrain.config.models import (
    data_files,
    fitted_fluid_file,
    geometry_name,
    number_name,
    parse_study,
    point_name,
    read_yaml,
    simulated,
    simulated_deborahs,
    train_name,
)
from viscotrain.errors import ConfigError

# A config given with --configfile replaces the demo: no key of one leaks into the other.
if not workflow.configfiles:

    configfile: "config/config.yaml"


try:
    STUDY = parse_study(
        config,
        source=", ".join(map(str, workflow.configfiles)),
        known_problems=[
            line for path in workflow.configfiles for line in read_yaml(path)[1]
        ],
    )
    MEASURED = data_files(STUDY, workflow.configfiles[-1])
except ConfigError as error:
    raise WorkflowError(str(error)) from None

RESULTS = f"results/{STUDY.study}"
# What every job needs whose fluid is fitted, and nothing for a config that writes its fluid.
FITTED_FLUID = {"fluid": fitted_fluid_file(STUDY)} if MEASURED else {}


report: "workflow/report/study.rst"


rule all:
    default_target: True
    input:
        f"{RESULTS}/summary.txt",
        f"{RESULTS}/interactive.html",


include: "workflow/rules/fluid_fit.smk"
include: "workflow/rules/dns.smk"
include: "workflow/rules/transient.smk"
include: "workflow/rules/table.smk"
include: "workflow/rules/trains.smk"
include: "workflow/rules/movies.smk"
include: "workflow/rules/design_map.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/summary.smk"
include: "workflow/rules/interactive.smk"
include: "workflow/rules/verification.smk"


onsuccess:
    if os.path.exists(f"{RESULTS}/summary.txt"):
        print(open(f"{RESULTS}/summary.txt", encoding="utf-8").read())


onerror:
    print(f"What failed is in the logs: {RESULTS}/logs/. Run again to go on from here.")
