"""How far the uncertainty of a fit reaches, for a config that names measured data."""

if SPREAD:

    rule fit_spread:
        input:
            **FITTED_FLUID,
            fit=f"{RESULTS}/fluid_fit/fit.nc",
            order=f"{RESULTS}/order/order.nc",
        output:
            result=SPREAD[0],
            configs=DRAWS,
        log:
            f"{LOGS}/fit_spread.log",
        conda:
            ENVIRONMENT
        resources:
            **not_solving("fit_spread"),
        params:
            **given("fit_spread", stages.fit_spread(STUDY)),
        message:
            "Following the uncertainty of the fit to pressure and order"
        script:
            "../../scripts/fit_spread.py"
