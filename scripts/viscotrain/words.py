"""Words that all rooms share: names of spheres, outcomes of simulations, limits.

This module imports nothing: the workflow reads it for every job.
"""

PARTICLES = ("trailing", "middle", "leading")  # spheres of a triplet, along the flow
TRAILING, MIDDLE, LEADING = range(3)
OF_A_PAIR = ("trailing", "leading")  # spheres of a pair alone
PAIRS = ("middle-trailing", "leading-middle")  # sphere ahead minus sphere behind

SOLVED, NOT_CONVERGED, NOT_ATTEMPTED, INACCURATE = range(4)  # status of a simulated point

CONTACT = 1.0  # distance of touching spheres, in d
NEGLIGIBLE = 1e-6  # relative velocities below this are the simulation's error, in Ubar
FASTEST = 2.0  # Ubar, on the axis of a Newtonian fluid: no sphere and no thinning fluid is faster
FEWEST_TRAIN_SPHERES = 3  # that a train starts with, so a channel must hold them

ORDERED_VARIATION = 0.25  # CV of the spacing of a train that counts as ordered, unless a study says

DEBORAH_NUMBERS = {  # variables of datasets
    "deborah": "Deborah number, as the study defines it",
    "deborah_longest_mode": "Deborah number of the longest relaxation time",
    "deborah_mean_relaxation_time": "Deborah number of the viscosity-weighted mean relaxation time",
}

QUASI_STEADY_LIMIT = 0.1  # memory number (`table.memory`) up to which distances may be held
BEYOND_QUASI_STEADY = "beyond the quasi-steady range"


def quasi_steady_remark(memory_number: float) -> str:
    """Says that a memory number is above the limit; empty if it is not, or not known."""
    return BEYOND_QUASI_STEADY if memory_number > QUASI_STEADY_LIMIT else ""


MOST_REPEATED = 4  # repeats of trains that are simulated again for their model error,
REPEATED_SHARE = 4  # and at most one of so many, so that it takes half as long as the trains


def repeated(repeats):
    """How many repeats of trains are simulated again for their model error."""
    return min(MOST_REPEATED, max(1, repeats // REPEATED_SHARE))


def has_solution(status):
    """Whether there are velocities, be they less accurate than asked for; of any shape."""
    return (status == SOLVED) | (status == INACCURATE)
