"""viscotrain: from a fluid, a channel and a particle to verified velocities, trains and figures."""

# A config given with --configfile replaces the demo: no key of one leaks into the other.
if not workflow.configfiles:

    configfile: "config/config.yaml"


include: "workflow/rules/common.smk"


report: "workflow/report/study.rst"


if len(STUDIES) == 1:

    include: "workflow/rules/fluid_fit.smk"
    include: "workflow/rules/units.smk"
    include: "workflow/rules/channel_flow.smk"
    include: "workflow/rules/dns.smk"
    include: "workflow/rules/transient.smk"
    include: "workflow/rules/table.smk"
    include: "workflow/rules/trains.smk"
    include: "workflow/rules/measured.smk"
    include: "workflow/rules/movies.smk"
    include: "workflow/rules/design_map.smk"
    include: "workflow/rules/order.smk"
    include: "workflow/rules/operating_conditions.smk"
    include: "workflow/rules/diameter_variation.smk"
    include: "workflow/rules/encapsulation.smk"
    include: "workflow/rules/fit_spread.smk"
    include: "workflow/rules/figures.smk"
    include: "workflow/rules/summary.smk"
    include: "workflow/rules/interactive.smk"
    include: "workflow/rules/design.smk"
    include: "workflow/rules/verification.smk"

    rule all:
        default_target: True
        input:
            everything(workflow.rules),

else:

    # Several diameters: all of the above for each, as a module, and what compares them.
    for MODULE, OWN_CONFIG in MODULES.items():

        module:
            name: MODULE
            snakefile:
                "Snakefile"
            config:
                OWN_CONFIG

        use rule * from MODULE as MODULE*

    include: "workflow/rules/confinement.smk"

    # What can be asked for by name can be asked for of all: `snakemake order`.
    for TARGET, FILES in common_targets(workflow.rules).items():

        rule:
            name:
                TARGET
            default_target: TARGET == "all"
            input:
                FILES,


# A second each: not worth a place in the queue of a cluster.
localrules:
    all,
    study_config,
    units,
    interactive,
    summary,


onstart:
    from snakemake.logging import logger
    from viscotrain.errors import RunError
    from viscotrain.jobs.running import hold
    from viscotrain.jobs.stopping import listen
    from viscotrain.jobs.watch import HolesWatch

    listen(logger)
    for study in STUDIES:
        folder = f"results/{study.study}"
        try:
            hold(folder)
        except RunError as error:
            raise WorkflowError(str(error)) from None
        logger.addHandler(HolesWatch(study, folder))


onsuccess:
    if os.path.exists(f"{RESULTS}/summary.txt"):
        print(open(f"{RESULTS}/summary.txt", encoding="utf-8").read())


onerror:
    print(f"Not finished. Logs are in {LOGS}/; run again to go on from here.")
