"""One page for a browser: any De and any train of the study, without a network."""


rule interactive:
    input:
        table=f"{RESULTS}/table/velocity_table.nc",
        trains=expand(f"{RESULTS}/trains/{{train}}.nc", train=TRAINS),
    output:
        f"{RESULTS}/interactive.html",
    log:
        f"{RESULTS}/logs/interactive.log",
    conda:
        "../../envs/viscotrain.yaml"
    params:
        code=provenance.digest(provenance.INTERACTIVE),
    message:
        "Making the interactive page"
    script:
        "../../scripts/interactive.py"
