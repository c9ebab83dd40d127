"""What the run made, in a few lines; printed at its end."""


rule summary:
    input:
        table=f"{RESULTS}/table/velocity_table.nc",
        trains=expand(f"{RESULTS}/trains/{{train}}.nc", train=TRAINS),
        movies=expand(f"{RESULTS}/movies/{{train}}", train=MOVIES),
        design_map=[f"{RESULTS}/design_map/design_map.nc"] if MAP else [],
        figures=expand(f"{RESULTS}/figures/{{figure}}.png", figure=FIGURES),
        timing=[
            f"{RESULTS}/{name.format(folder='timing/')}.csv" for name in SIMULATIONS
        ],
    output:
        report(
            f"{RESULTS}/summary.txt",
            caption="../report/summary.rst",
            category="Study",
            labels={"figure": "summary"},
        ),
        report(
            f"{RESULTS}/config.yaml",
            caption="../report/config.rst",
            category="Study",
            labels={"figure": "config with all defaults"},
        ),
    log:
        f"{RESULTS}/logs/summary.log",
    conda:
        "../../envs/viscotrain.yaml"
    message:
        "Summing up"
    script:
        "../../scripts/summary.py"
