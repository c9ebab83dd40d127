"""Numbers of all conditions that were simulated, and the limits that they exceed."""


rule operating_conditions:
    input:
        **FITTED_FLUID,
        units=UNITS,
        flow=CHANNEL_FLOW,
        trains=[
            *expand(f"{RESULTS}/trains/{{train}}.nc", train=TRAINS),
            *expand(f"{RESULTS}/design_map/{{train}}.nc", train=MAP),
        ],
    output:
        result=CONDITIONS,
        csv=report(
            f"{RESULTS}/operating_conditions.csv",
            caption="../report/operating_conditions.rst",
            category="Design",
            labels={"figure": "operating conditions"},
        ),
    log:
        f"{LOGS}/operating_conditions.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("operating_conditions"),
    params:
        **given("operating_conditions", stages.operating_conditions(STUDY)),
    message:
        "Operating conditions: what their numbers are, and which limits they exceed"
    script:
        "../../scripts/operating_conditions.py"
