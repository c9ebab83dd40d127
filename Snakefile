"""viscotrain: from a fluid, a channel and a particle to verified velocities, trains and figures."""

# A config given with --configfile replaces the demo: no key of one leaks into the other.
if not workflow.configfiles:

    configfile: "config/config.yaml"


include: "workflow/rules/common.smk"


report: "workflow/report/study.rst"


rule all:
    default_target: True
    input:
        f"{RESULTS}/summary.txt",
        f"{RESULTS}/config.yaml",
        f"{RESULTS}/interactive.html",


include: "workflow/rules/fluid_fit.smk"
include: "workflow/rules/units.smk"
include: "workflow/rules/dns.smk"
include: "workflow/rules/transient.smk"
include: "workflow/rules/table.smk"
include: "workflow/rules/trains.smk"
include: "workflow/rules/measured.smk"
include: "workflow/rules/movies.smk"
include: "workflow/rules/design_map.smk"
include: "workflow/rules/order.smk"
include: "workflow/rules/encapsulation.smk"
include: "workflow/rules/fit_spread.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/summary.smk"
include: "workflow/rules/interactive.smk"
include: "workflow/rules/verification.smk"


# A second each: not worth a place in the queue of a cluster.
localrules:
    all,
    study_config,
    units,
    interactive,
    summary,


onstart:
    from snakemake.logging import logger
    from viscotrain.jobs.watch import HolesWatch

    logger.addHandler(HolesWatch(STUDY, RESULTS))


onsuccess:
    if os.path.exists(f"{RESULTS}/summary.txt"):
        print(open(f"{RESULTS}/summary.txt", encoding="utf-8").read())


onerror:
    print(f"What failed is in the logs: {LOGS}/. Run again to go on from here.")
