"""Flow of the fluid through the channel without spheres: velocity, pressure, shear at the wall."""


rule channel_flow:
    input:
        **FITTED_FLUID,
    output:
        result=CHANNEL_FLOW,
    log:
        f"{LOGS}/channel_flow.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("channel_flow"),
    params:
        **given("channel_flow", stages.channel_flow(STUDY)),
    message:
        "Flow through the channel without spheres"
    script:
        "../../scripts/channel_flow.py"
