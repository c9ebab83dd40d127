"""Look-up table of velocities, with its interpolation error."""

if GIVEN_TABLE:

    rule given_table:
        input:
            **FITTED_FLUID,
            source=GIVEN_TABLE,
        output:
            table=TABLE,
        log:
            f"{LOGS}/table/velocity_table.log",
        conda:
            ENVIRONMENT
        resources:
            **not_solving("table"),
        params:
            **given("given_table", stages.given_table(STUDY)),
        message:
            "Checking that the given table is of this study"
        script:
            "../../scripts/given_table.py"

else:

    rule table:
        input:
            results=[f"{RESULTS}/{stage}/{name}.nc" for stage, name in SIMULATIONS],
            spheres=[f"{RESULTS}/{stage}/{name}.nc" for stage, name in SINGLE_SPHERES],
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
