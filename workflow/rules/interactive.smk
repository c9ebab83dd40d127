"""One page for a browser: any De and any train of the study, without a network."""


rule interactive:
    input:
        table=TABLE,
        units=UNITS,
        flow=CHANNEL_FLOW,
        order=f"{RESULTS}/order/order.nc",
        trains=expand(f"{RESULTS}/trains/{{train}}.nc", train=TRAINS),
    output:
        page=f"{RESULTS}/interactive.html",
    log:
        f"{LOGS}/interactive.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("interactive"),
    params:
        **given("interactive"),
    message:
        "Making the interactive page"
    script:
        "../../scripts/interactive.py"
