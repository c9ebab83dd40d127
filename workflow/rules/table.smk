"""Look-up table of velocities, with its interpolation error."""


rule table:
    input:
        results=[f"{RESULTS}/{stage}/{name}.nc" for stage, name in SIMULATIONS],
    output:
        table=TABLE,
    log:
        f"{LOGS}/table/velocity_table.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("table"),
    params:
        **given("table", stages.table(STUDY)),
    message:
        "Combining all geometries to the velocity table"
    script:
        "../../scripts/table.py"
