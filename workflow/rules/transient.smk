"""Start-up from rest: one job per geometry (sp, sf) and Deborah number."""


rule transient:
    input:
        **FITTED_FLUID,
    output:
        result=f"{RESULTS}/transient/sp{{sp}}_sf{{sf}}_De{{deborah}}.nc",
        timing=f"{RESULTS}/transient/timing/sp{{sp}}_sf{{sf}}_De{{deborah}}.csv",
    log:
        f"{LOGS}/transient/sp{{sp}}_sf{{sf}}_De{{deborah}}.log",
    conda:
        ENVIRONMENT
    threads: 1
    resources:
        **solving("transient"),
    params:
        **given("transient"),
        settings=transient_settings,
    message:
        "Simulating the start-up of sp = {wildcards.sp}, sf = {wildcards.sf}, "
        "De = {wildcards.deborah}"
    script:
        "../../scripts/transient.py"


# First, as in the dns stage.
use rule transient as transient_single_sphere with:
    wildcard_constraints:
        sp="inf",
        sf="inf",
    priority: 1


ruleorder: transient_single_sphere > transient
