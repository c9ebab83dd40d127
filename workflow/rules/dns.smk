"""Direct numerical simulation: geometries (sp, sf), each through all its Deborah numbers.

A job solves several of them, and is a rule of its own since Snakemake cannot compute outputs.
"""

for DNS_NUMBER, DNS_GEOMETRIES in enumerate(DNS_JOBS, 1):
    DNS_NAMES = [geometry_name(*geometry) for geometry in DNS_GEOMETRIES]

    rule:
        name:
            f"dns_{DNS_NUMBER}"
        input:
            **FITTED_FLUID,
        output:
            **(
                {
                    "fields": [
                        kept(directory(f"{RESULTS}/dns/{name}")) for name in DNS_NAMES
                    ]
                }
                if STUDY.dns.save_fields
                else {}
            ),
            result=[kept(f"{RESULTS}/dns/{name}.nc") for name in DNS_NAMES],
            timing=[kept(f"{RESULTS}/dns/timing/{name}.csv") for name in DNS_NAMES],
        log:
            f"{LOGS}/dns/job_{DNS_NUMBER}.log",
        # The table needs all of them, and most else the table; where the single sphere cannot be
        # solved nothing can.
        priority: 4 if (math.inf, math.inf) in DNS_GEOMETRIES else 3
        retries: 1  # a process that died, for want of memory perhaps: with twice as much
        conda:
            ENVIRONMENT
        threads: 1
        resources:
            **solving("dns", len(DNS_GEOMETRIES)),
        params:
            **given("dns", stages.dns(STUDY, *DNS_GEOMETRIES[0])),
        message:
            simulating(DNS_NAMES)
        script:
            "../../scripts/dns.py"


# How velocities follow the diameter, for spheres that are not equal.
if SINGLE_SPHERES:

    rule other_diameter:
        input:
            **FITTED_FLUID,
        output:
            result=[kept(f"{RESULTS}/dns/{name}.nc") for _, name in SINGLE_SPHERES],
            timing=[
                kept(f"{RESULTS}/dns/timing/{name}.csv") for _, name in SINGLE_SPHERES
            ],
        log:
            f"{LOGS}/dns/other_diameter.log",
        priority: 3
        retries: 1
        conda:
            ENVIRONMENT
        threads: 1
        resources:
            **solving("dns", len(SINGLE_SPHERES)),
        params:
            **given("dns"),
            settings=[stages.single_sphere(STUDY, ratio).stated() for ratio in RATIOS],
        message:
            f"Simulating single spheres of {', '.join(f'{ratio:g}' for ratio in RATIOS)} "
            "times the diameter"
        script:
            "../../scripts/dns.py"


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
