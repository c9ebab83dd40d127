"""What the run made, in a few lines; printed at its end."""


rule summary:
    input:
        table=f"{RESULTS}/table/velocity_table.nc",
        trains=expand(f"{RESULTS}/trains/{{train}}.nc", train=TRAINS),
        figures=expand(f"{RESULTS}/figures/{{figure}}.png", figure=FIGURES),
        timing=[f"{RESULTS}/{name.format(kind='timing/')}.csv" for name in SIMULATIONS],
    output:
        f"{RESULTS}/summary.txt",
    log:
        f"{RESULTS}/logs/summary.log",
    conda:
        "../../envs/viscotrain.yaml"
    message:
        "Summing up"
    script:
        "../../scripts/summary.py"
