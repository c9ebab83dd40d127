"""Look-up table of velocities, with its interpolation error."""


rule table:
    input:
        **FITTED_FLUID,
        results=expand(f"{RESULTS}/dns/{{geometry}}.nc", geometry=GRID + BETWEEN),
    output:
        f"{RESULTS}/table/velocity_table.nc",
    log:
        f"{RESULTS}/logs/table/velocity_table.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.TABLE),
        settings=STUDY.table.model_dump(mode="json"),
    message:
        "Combining all geometries to the velocity table"
    script:
        "../../scripts/table.py"
