"""The fluid: its parameters and scales, what a rheometer measures, the fit to measured data."""
