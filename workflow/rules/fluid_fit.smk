"""Fit of the fluid to measured data, for a config that names some: upstream of everything else."""

if MEASURED:

    rule fluid_fit:
        input:
            MEASURED,
        output:
            fluid=f"{RESULTS}/fluid_fit/fluid.yaml",
            fit=f"{RESULTS}/fluid_fit/fit.nc",
        log:
            f"{RESULTS}/logs/fluid_fit.log",
        conda:
            "../../envs/viscotrain.yaml"
        params:
            code=provenance.digest(provenance.FLUID_FIT),
            settings=STUDY.fluid.model_dump(mode="json"),
        message:
            "Fitting the fluid to measured data"
        script:
            "../../scripts/fluid_fit.py"
