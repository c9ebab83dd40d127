"""Trains of the study whose diameters vary by more and more, by simulation and linear theory."""


rule diameter_variation:
    input:
        **DUCT,
        table=TABLE,
    output:
        result=f"{RESULTS}/diameter_variation/diameter_variation.nc",
        figure=report(
            f"{FIGURES}/diameter_variation.png",
            caption="../report/diameter_variation.rst",
            category="Design",
            labels={"figure": "variation of diameters"},
        ),
        data=multiext(f"{FIGURES}/diameter_variation", ".pdf", ".nc"),
    log:
        f"{LOGS}/diameter_variation.log",
    priority: 1  # short jobs last: they keep all cores busy to the end
    conda:
        ENVIRONMENT
    resources:
        **varying_diameters(),
    params:
        **given("diameter_variation", stages.diameter_variation(STUDY)),
    message:
        "Trains of spheres whose diameters vary"
    script:
        "../../scripts/diameter_variation.py"
