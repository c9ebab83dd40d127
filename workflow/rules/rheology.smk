"""Figure of the fluid: moduli and viscosity, with measured data where the fluid is fitted."""


rule rheology:
    input:
        **(FITTED_FLUID | {"fit": f"{RESULTS}/fluid_fit/fit.nc"} if MEASURED else {}),
    output:
        report(
            f"{RESULTS}/figures/rheology.png",
            caption="../report/rheology.rst",
            category="Study",
            labels={"figure": "fluid"},
        ),
        multiext(f"{RESULTS}/figures/rheology", ".pdf", ".csv"),
    log:
        f"{RESULTS}/logs/figures/rheology.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        settings=STUDY.rheology_settings(),
    message:
        "Figure: moduli and viscosity of the fluid"
    script:
        "../../scripts/rheology.py"
