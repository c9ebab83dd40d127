"""Particle trains: one job per Deborah number and volume fraction, with all its repeats."""

TRAINS = [
    train_name(De, phi)
    for De in STUDY.trains.deborah
    for phi in STUDY.trains.volume_fraction
]


wildcard_constraints:
    deborah=r"[0-9.e+-]+",
    volume_fraction=r"[0-9.e+-]+",


rule trains:
    input:
        f"{RESULTS}/table/velocity_table.nc",
        **FITTED_FLUID,
    output:
        f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
    log:
        f"{RESULTS}/logs/trains/De{{deborah}}_phi{{volume_fraction}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.TRAINS),
        settings=STUDY.trains_settings(),
        volume_fraction=lambda wildcards: [float(wildcards.volume_fraction)],
    message:
        "Simulating trains at De = {wildcards.deborah}, phi = {wildcards.volume_fraction}"
    script:
        "../../scripts/trains.py"
