"""Look-up table of velocities, with its interpolation error."""

if STUDY.dns.method == "transient":
    SIMULATIONS = [
        f"transient/{{folder}}{point_name(*geometry, De)}"
        for geometry, deborahs in simulated(STUDY).items()
        for De in deborahs
    ]
else:
    SIMULATIONS = [
        f"dns/{{folder}}{geometry_name(*geometry)}" for geometry in simulated(STUDY)
    ]


rule table:
    input:
        **FITTED_FLUID,
        results=[f"{RESULTS}/{name.format(folder='')}.nc" for name in SIMULATIONS],
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
