"""Design map: trains over (De, volume fraction) in physical units, drawn where it is made."""


rule design_map:
    input:
        table=TABLE,
        units=UNITS,
        flow=CHANNEL_FLOW,
        points=expand(f"{RESULTS}/design_map/{{train}}.nc", train=MAP),
    output:
        result=f"{RESULTS}/design_map/design_map.nc",
        law=report(
            f"{FIGURES}/spacing_law.png",
            caption="../report/spacing_law.rst",
            category="Design",
            labels={"figure": "spacing_law"},
        ),
        figure=report(
            f"{FIGURES}/design_map.png",
            caption="../report/design_map.rst",
            category="Design",
            labels={"figure": "design_map"},
        ),
        data=multiext(f"{FIGURES}/spacing_law", ".pdf", ".csv")
        + multiext(f"{FIGURES}/design_map", ".pdf", ".csv"),
    log:
        f"{LOGS}/design_map/design_map.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("design_map"),
    params:
        **given("design_map", stages.design_map(STUDY)),
    message:
        "Combining all conditions to the design map"
    script:
        "../../scripts/design_map.py"
