"""Direct numerical simulation: one job per geometry (sp, sf), through all Deborah numbers."""


rule dns:
    input:
        **FITTED_FLUID,
    output:
        **(
            {"fields": directory(f"{RESULTS}/dns/sp{{sp}}_sf{{sf}}")}
            if STUDY.dns.save_fields
            else {}
        ),
        result=f"{RESULTS}/dns/sp{{sp}}_sf{{sf}}.nc",
        timing=f"{RESULTS}/dns/timing/sp{{sp}}_sf{{sf}}.csv",
    log:
        f"{LOGS}/dns/sp{{sp}}_sf{{sf}}.log",
    conda:
        ENVIRONMENT
    threads: 1
    resources:
        **solving("dns"),
    params:
        **given("dns"),
        settings=dns_settings,
    message:
        "Simulating the triplet sp = {wildcards.sp}, sf = {wildcards.sf}"
    script:
        "../../scripts/dns.py"


# Where the single sphere cannot be solved nothing can, and every table needs it.
use rule dns as dns_single_sphere with:
    wildcard_constraints:
        sp="inf",
        sf="inf",
    priority: 1


ruleorder: dns_single_sphere > dns


# What the velocity changes with the diameter, for spheres that are not equal.
use rule dns as dns_other_diameter with:
    output:
        result=f"{RESULTS}/dns/sp{{sp}}_sf{{sf}}_d{{diameter_ratio}}.nc",
        timing=f"{RESULTS}/dns/timing/sp{{sp}}_sf{{sf}}_d{{diameter_ratio}}.csv",
    log:
        f"{LOGS}/dns/sp{{sp}}_sf{{sf}}_d{{diameter_ratio}}.log",
    params:
        **given("dns"),
        settings=single_sphere_settings,
    message:
        "Simulating a single sphere of {wildcards.diameter_ratio} times the diameter"


if STUDY.field_point():

    rule field:
        input:
            **FITTED_FLUID,
        output:
            result=f"{RESULTS}/dns/field.nc",
        log:
            f"{LOGS}/dns/field.log",
        conda:
            ENVIRONMENT
        threads: 1
        resources:
            **solving("dns"),
        params:
            **given("field", stages.field(STUDY)),
        message:
            "Computing the fields of the triplet that is drawn"
        script:
            "../../scripts/field.py"
