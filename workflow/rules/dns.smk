"""Direct numerical simulation: one job per geometry (sp, sf), through all Deborah numbers."""


wildcard_constraints:
    sp=r"[0-9.e+-]+|inf",
    sf=r"[0-9.e+-]+|inf",


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
        f"{RESULTS}/logs/dns/sp{{sp}}_sf{{sf}}.log",
    conda:
        "../../envs/viscotrain.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        physics=provenance.digest(provenance.PHYSICS),
        settings=STUDY.dns_settings(),
        deborah=lambda wildcards: simulated_deborahs(
            STUDY, float(wildcards.sp), float(wildcards.sf)
        ),
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


rule field:
    input:
        **FITTED_FLUID,
    output:
        f"{RESULTS}/dns/field.nc",
    log:
        f"{RESULTS}/logs/dns/field.log",
    conda:
        "../../envs/viscotrain.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        physics=provenance.digest(provenance.FIELD),
        settings=STUDY.dns_settings(),
        point=STUDY.field_point().model_dump(mode="json"),
    message:
        "Computing the fields of the triplet that is drawn"
    script:
        "../../scripts/field.py"
