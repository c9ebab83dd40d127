"""Order of equally spaced trains from the table alone: stability, ordering length, a figure."""


rule order:
    input:
        **({"simulated": f"{RESULTS}/design_map/design_map.nc"} if MAP else {}),
        **DUCT,
        table=TABLE,
        units=UNITS,
    output:
        result=f"{RESULTS}/order/order.nc",
        figure=report(
            f"{FIGURES}/order.png",
            caption="../report/order.rst",
            category="Design",
            labels={"figure": "ordering length"},
        ),
        data=multiext(f"{FIGURES}/order", ".pdf", ".nc"),
    log:
        f"{LOGS}/order.log",
    conda:
        ENVIRONMENT
    resources:
        **not_solving("order"),
    params:
        **given("order", stages.order(STUDY)),
    message:
        "Ordering lengths of equally spaced trains"
    script:
        "../../scripts/order.py"
