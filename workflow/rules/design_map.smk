"""Design map: trains over (De, volume fraction), then all of them in physical units."""

MAP = [train_name(De, phi) for De, phi in STUDY.map_conditions()]


rule design_point:
    input:
        f"{RESULTS}/table/velocity_table.nc",
        **FITTED_FLUID,
    output:
        f"{RESULTS}/design_map/De{{deborah}}_phi{{volume_fraction}}.nc",
    log:
        f"{RESULTS}/logs/design_map/De{{deborah}}_phi{{volume_fraction}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.TRAINS),
        settings=STUDY.map_settings(),
    message:
        "Design map: trains at De = {wildcards.deborah}, phi = {wildcards.volume_fraction}"
    script:
        "../../scripts/trains.py"


rule design_map:
    input:
        **FITTED_FLUID,
        points=expand(f"{RESULTS}/design_map/{{train}}.nc", train=MAP),
    output:
        f"{RESULTS}/design_map/design_map.nc",
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
