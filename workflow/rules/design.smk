"""Whether trains form in this device: trains of many conditions, ranked, and the answer as a page.

Asked for by name: snakemake design."""


rule design_trains:
    input:
        **DUCT,
        table=TABLE,
        units=UNITS,
    output:
        trains=[f"{RESULTS}/design/De{{deborah}}_{name}.nc" for name in DESIGN_TRAINS],
    log:
        f"{LOGS}/design/De{{deborah}}.log",
    conda:
        ENVIRONMENT
    resources:
        **designing(),
    params:
        **given("design_trains", stages.design_trains(STUDY)),
    message:
        "Design: trains at De = {wildcards.deborah}"
    script:
        "../../scripts/design_trains.py"


rule design:
    input:
        asked_for("design"),
        **FITTED_FLUID,
        **DUCT,
        table=TABLE,
        units=UNITS,
        flow=CHANNEL_FLOW,
        trains=expand(
            f"{RESULTS}/design/De{{deborah}}_{{name}}.nc",
            deborah=DESIGN_DEBORAHS,
            name=DESIGN_TRAINS,
        ),
    output:
        page=f"{RESULTS}/design/design.html",
        text=f"{RESULTS}/design/design.txt",
        conditions=f"{RESULTS}/design/design.csv",
        figure=report(
            f"{FIGURES}/design.png",
            caption="../report/design.rst",
            category="Design",
            labels={"figure": "design"},
        ),
        data=multiext(f"{FIGURES}/design", ".pdf", ".csv"),
    log:
        f"{LOGS}/design/design.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("design"),
    params:
        **given("design", stages.design(STUDY)),
    message:
        "Design: the answer"
    script:
        "../../scripts/design.py"
