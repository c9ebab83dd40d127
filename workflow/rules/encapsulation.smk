"""Beads in droplets, if the channel ends in a droplet generator: all conditions, and a figure."""


rule encapsulation:
    input:
        units=UNITS,
        trains=expand(f"{RESULTS}/trains/{{train}}.nc", train=TRAINS),
        points=expand(f"{RESULTS}/design_map/{{train}}.nc", train=MAP),
    output:
        result=f"{RESULTS}/encapsulation/encapsulation.nc",
        table=f"{RESULTS}/encapsulation/encapsulation.csv",
        feeds=f"{RESULTS}/encapsulation/feeds.csv",
        figure=report(
            f"{FIGURES}/encapsulation.png",
            caption="../report/encapsulation.rst",
            category="Design",
            labels={"figure": "beads in droplets"},
        ),
        data=multiext(f"{FIGURES}/encapsulation", ".pdf", ".nc"),
    log:
        f"{LOGS}/encapsulation.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("encapsulation"),
    params:
        **given("encapsulation", stages.encapsulation(STUDY)),
    message:
        "Counting beads in droplets"
    script:
        "../../scripts/encapsulation.py"
