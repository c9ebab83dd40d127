"""Fit of the fluid to measured data, for a config that names some: upstream of everything else."""

if MEASURED:

    rule fluid_fit:
        input:
            files=MEASURED,
        output:
            fluid=f"{RESULTS}/fluid_fit/fluid.yaml",
            fit=f"{RESULTS}/fluid_fit/fit.nc",
        log:
            f"{LOGS}/fluid_fit.log",
        conda:
            ENVIRONMENT
        resources:
            **not_solving("fluid_fit"),
        params:
            **given("fluid_fit", stages.fluid_fit(STUDY)),
        message:
            "Fitting the fluid to measured data"
        script:
            "../../scripts/fluid_fit.py"
