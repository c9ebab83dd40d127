"""Particle trains: one job per Deborah number and volume fraction, with all its repeats.

Those of the design map are recorded elsewhere; one job makes all volume fractions at a De.
"""


rule trains:
    input:
        **DUCT,
        table=TABLE,
    output:
        trains=f"{RESULTS}/trains/De{{deborah}}_phi{{volume_fraction}}.nc",
    log:
        f"{LOGS}/trains/De{{deborah}}_phi{{volume_fraction}}.log",
    # The longest jobs first, and before them what films wait for.
    priority: 2
    conda:
        ENVIRONMENT
    resources:
        **simulating_trains(STUDY.trains, STUDY.trains.feed),
    params:
        **given("trains", stages.trains(STUDY)),
        volume_fraction=lambda wildcards: [parse_fraction(wildcards.volume_fraction)],
    message:
        "Simulating trains at De{wildcards.deborah}_phi{wildcards.volume_fraction}"
    script:
        "../../scripts/trains.py"


use rule trains as design_points with:
    output:
        trains=[
            f"{RESULTS}/design_map/De{{deborah}}_phi{fraction_name(phi, STUDY.map_feed)}.nc"
            for phi in MAP_FRACTIONS
        ],
    log:
        f"{LOGS}/design_map/De{{deborah}}.log",
    priority: 2
    resources:
        **simulating_trains(STUDY.design_map, STUDY.map_feed, MAP_FRACTIONS),
    params:
        **given("trains", stages.design_points(STUDY)),
        volume_fraction=MAP_FRACTIONS,
    message:
        "Design map: trains at De = {wildcards.deborah}"
