"""Several diameters: what compares them, and the config of them all."""


rule confinement:
    input:
        tables=made_by("table", "table"),
        orders=made_by("order", "result"),
        units=made_by("units", "result"),
        maps=made_by("design_map", "result") if MAP else [],
    output:
        result=f"{RESULTS}/confinement/confinement.nc",
        summary=report(
            f"{RESULTS}/summary.txt",
            caption="../report/summary.rst",
            category="Confinement",
            labels={"figure": "summary"},
        ),
        page=f"{RESULTS}/interactive.html",
        figures=[
            report(
                f"{FIGURES}/{name}.png",
                caption=f"../report/{name}.rst",
                category="Confinement",
                labels={"figure": name.removeprefix("confinement_").replace("_", " ")},
            )
            for name in COMPARING
        ],
        data=expand(f"{FIGURES}/{{name}}{{end}}", name=COMPARING, end=[".pdf", ".csv"]),
    log:
        f"{LOGS}/confinement.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("confinement"),
    params:
        **given("confinement", stages.confinement(STUDIES)),
    message:
        "Comparing all diameters"
    script:
        "../../scripts/confinement.py"


rule study_config:
    input:
        **FITTED_FLUID,
    output:
        result=f"{RESULTS}/config.yaml",
    log:
        f"{LOGS}/config.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("summary"),
    params:
        **given("study_config", config_of(STUDIES)),
    message:
        "Writing the config of all diameters with all defaults"
    script:
        "../../scripts/study_config.py"
