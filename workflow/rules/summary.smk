"""What the run made, in a few lines, printed at its end; and the config that it is of."""


rule summary:
    input:
        table=TABLE,
        units=UNITS,
        conditions=CONDITIONS,
        spread=SPREAD,
        trains=expand(f"{RESULTS}/trains/{{train}}.nc", train=TRAINS),
        measured=[
            f"{RESULTS}/measured/{train}.nc" for train in TRAINS if MEASURED_SPACINGS
        ],
        # folders have no checksum that could tell a copy from a change
        movies=ancient(expand(f"{RESULTS}/movies/{{train}}", train=MOVIES)),
        maps=[f"{RESULTS}/design_map/design_map.nc"] if MAP else [],
        droplets=f"{RESULTS}/encapsulation/encapsulation.nc",
        figures=expand(f"{FIGURES}/{{figure}}.png", figure=ALL_FIGURES),
        timing=[
            f"{RESULTS}/{stage}/timing/{name}.csv"
            for stage, name in SIMULATIONS + SINGLE_SPHERES
        ],
    output:
        summary=report(
            f"{RESULTS}/summary.txt",
            caption="../report/summary.rst",
            category="Study",
            labels={"figure": "summary"},
        ),
    log:
        f"{LOGS}/summary.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("summary"),
    params:
        **given("summary"),
    message:
        "Summing up"
    script:
        "../../scripts/summary.py"


rule study_config:
    input:
        **FITTED_FLUID,
    output:
        result=report(
            f"{RESULTS}/config.yaml",
            caption="../report/config.rst",
            category="Study",
            labels={"figure": "config with all defaults"},
        ),
    log:
        f"{LOGS}/config.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("summary"),
    params:
        **given("study_config", stages.study_config(STUDY)),
    message:
        "Writing the config with all defaults"
    script:
        "../../scripts/study_config.py"
