"""Physical units of a study, for what shows them; all other results are dimensionless."""


rule units:
    input:
        **FITTED_FLUID,
    output:
        result=UNITS,
    log:
        f"{LOGS}/units.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("units"),
    params:
        **given("units", stages.units(STUDY)),
    message:
        "Writing the physical units of the study"
    script:
        "../../scripts/units.py"
