"""What the columns of CSV files mean, where a variable of the same name does not say it.

A name ends with the unit, and before it with `_halfwidth` and the like, as those of variables.
"""

UNITS = {  # ends of names
    "_D_per_Ubar": "D/Ubar",
    "_uL_per_min": "uL/min",
    "_uL_min-1": "uL/min",
    "_mm_s-1": "mm/s",
    "_per_second": "1/s",
    "_s-1": "1/s",
    "_per_bead": "1",
    "_percent": "%",
    "_bar": "bar",
    "_um": "um",
    "_cm": "cm",
    "_Ubar": "Ubar",
    "_seconds": "s",
    "_s": "s",
    "_d": "d",
    "_D": "D",
}

MEANINGS = {
    "injection": "law by which spheres enter",
    "spheres": "spheres that enter in a second",
    "beads": "beads that enter in a second",
    "channel_length": "length of a channel that ends at this station",
    "tube": "mean spacing by the law of a tube",
    "square_channel": "mean spacing by the law of a square channel",
    "of": "trains or map: where the condition is from",
    "droplets": "droplets in a second, those asked for, else the best",
    "beads_per_droplet": "mean number of beads in a droplet",
    "none": "share of droplets without a bead",
    "one": "share of droplets with one bead",
    "two_or_more": "share of droplets with two or more beads",
    "best_one": "largest share of droplets with one bead, over all frequencies",
    "best_droplets": "droplets per bead, or in a second, with that share",
    "lowest_droplets": "the same, the lowest with at least 95 % of that share",
    "highest_droplets": "the same, the highest with at least 95 % of that share",
    "possible": "False: spheres would be closer than contact",
}

OF_A_DESIGN = {
    "feed": "volume fraction of spheres in what is poured in",
    "volume": "volume fraction of spheres in the channel",
    "spacing": "mean distance of neighbours at the outlet",
    "spacing_d_error": "its sampling error plus model error",
    "variation": "coefficient of variation of the spacing at the outlet",
    "variation_sampling": "its sampling error, half of the 95 % interval",
    "variation_model": "its model error",
    "variation_at_inlet": "the same at the inlet, by the law of injection",
    "even": "share of spacings within 20 % of their mean",
    "touching": "share of spheres closer than 1.1 d to a neighbour",
    "single_best": "share of droplets with one bead at the best frequency",
    "single_sampling_best": "its sampling error, half of the 95 % interval",
    "single_random_best": "the same of beads at random",
    "best_droplets_per_second": "that frequency",
    "single_asked": "the same at the frequency that is asked for, if one is",
    "single_sampling_asked": "its sampling error, half of the 95 % interval",
    "single_random_asked": "the same of as many beads at random",
    "none_asked": "share of droplets without a bead, there",
    "pressure": "pressure drop of the channel without spheres",
    "forms": "whether a train forms: yes, partly or no",
    "reason": "limits of validity that it exceeds, and why",
    "has_wanted_rate": "whether beads come at the rate that is wanted",
    "single": "what droplets rank by: asked for, else best",
    "single_sampling": "its sampling error, half of the 95 % interval",
    "single_random": "the same of as many beads at random",
    "ordering_length": "length along which the fastest disturbance decays by e",
    "variation_by_linear_law": "CV at the outlet by the linear law",
    "largest_bead_variation": "largest variation of diameters with which it is even, by that law",
}

MEANINGS |= {
    "kind": "simulated or interpolated; measured, model, or wall, the rates of the flow",
    "distance": "distance of two spheres, centre to centre",
    "relative_velocity": "velocity of the leading sphere minus that of the trailing one",
    "quantity": "what is measured or computed",
    "unit": "its unit",
    "against": "what the abscissa is",
    "abscissa": "angular frequency or shear rate",
    "value": "the number, in that unit",
    "surface_distance": "distance of the surfaces of two spheres",
    "scaled_velocity": "the same over (d/D)^4",
    "error": "sampling error plus model error",
}

OF_CONVERGENCE = {
    "value": "of the setting that is varied: a factor of sizes, an order, a margin in D, a share "
    "of the time step",
    "default": "whether it is the one of the study",
    "elements": "elements of the mesh",
    "unknowns": "unknowns of the discrete problem",
    "middle_minus_trailing": "relative velocity in Ubar",
    "leading_minus_middle": "the same of the other pair",
    "steps": "time steps",
    "cpu": "CPU time",
    "error": "how far relative velocities are from those of the finest setting, in Ubar",
}

OF_CLOSURE = {
    "gap": "between surfaces, in d; or which one, of a train",
    "number": "of a relative velocity, the trailing one first",
    "direct": "relative velocity in Ubar, all spheres simulated",
    "closure": "by which the train model has it",
    "model": "the same by the train model",
    "error": "model minus simulation, in Ubar or d",
    "comparison": "equally spaced spheres, or a train",
    "time": "in D/Ubar",
    "distance": "of neighbours, in d, simulated",
    "model_distance": "the same by the train model",
}

OF_START_UP = {
    "time": "time since rest",
    "quasi_steady": "relative velocity at distances that are held",
    "relative_velocity": "sphere ahead minus sphere behind, from rest",
    "distance": "of the two spheres",
    "pair": "which two spheres",
}

OF_FILES = {  # by the name of the file
    "design": OF_A_DESIGN,
    "time_step": OF_CONVERGENCE,
    "closure": OF_CLOSURE,
    "start_up": OF_START_UP,
    "feeds": {"mean_spacing": "spacing of an equally spaced train"},
    "confinement_order": {
        "spacing": "spacing of an equally spaced train",
        "growth_length": "length along which the fastest disturbance grows by e, where one does",
    },
    "confinement_design_map": {
        "spacing_variation_inlet": "coefficient of variation of the spacing at the inlet",
        "error": "sampling error plus model error of the CV at the outlet",
        "remaining": "CV at the outlet over that at the inlet",
        "remaining_error": "its error, by that of the outlet",
    },
}
