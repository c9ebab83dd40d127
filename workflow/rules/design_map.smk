"""Design map: trains over (De, volume fraction), then all of them in physical units.

One job per De makes the trains of all its volume fractions; the map is drawn where it is made.
"""

MAP = [train_name(De, phi) for De, phi in STUDY.map_conditions()]
MAP_FRACTIONS = list(dict.fromkeys(phi for _, phi in STUDY.map_conditions()))


rule design_points:
    input:
        f"{RESULTS}/table/velocity_table.nc",
        **FITTED_FLUID,
    output:
        [
            f"{RESULTS}/design_map/De{{deborah}}_phi{number_name(phi)}.nc"
            for phi in MAP_FRACTIONS
        ],
    log:
        f"{RESULTS}/logs/design_map/De{{deborah}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.TRAINS),
        settings=STUDY.map_settings(),
        volume_fraction=MAP_FRACTIONS,
    message:
        "Design map: trains at De = {wildcards.deborah}"
    script:
        "../../scripts/trains.py"


rule design_map:
    input:
        **FITTED_FLUID,
        points=expand(f"{RESULTS}/design_map/{{train}}.nc", train=MAP),
    output:
        map=f"{RESULTS}/design_map/design_map.nc",
        law=report(
            f"{RESULTS}/figures/spacing_law.png",
            caption="../report/spacing_law.rst",
            category="Design",
            labels={"figure": "spacing_law"},
        ),
        figure=report(
            f"{RESULTS}/figures/design_map.png",
            caption="../report/design_map.rst",
            category="Design",
            labels={"figure": "design_map"},
        ),
        data=multiext(f"{RESULTS}/figures/spacing_law", ".pdf", ".csv")
        + multiext(f"{RESULTS}/figures/design_map", ".pdf", ".csv"),
    log:
        f"{RESULTS}/logs/design_map/design_map.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.DESIGN_MAP),
        ordered_variation=STUDY.design_map.ordered_variation,
    message:
        "Combining all conditions to the design map"
    script:
        "../../scripts/design_map.py"
