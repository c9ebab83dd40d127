"""The accuracy statements of README and docs: those of the verification, from the kept numbers."""

import pandas as pd
import pytest
from generate_accuracy_docs import KEPT, OUTLET, STATEMENT, headline, pages, rows

from viscotrain.studies.accuracy import KINDS, observed_orders, with_errors


def test_pages_hold_the_kept_statements():
    for path, text in pages().items():
        assert path.read_text(encoding="utf-8") == text, path.name


def test_headline_is_the_largest_error_of_each_kind():
    statement, outlet = (rows(path.read_text(encoding="utf-8")) for path in (STATEMENT, OUTLET))
    worse = ["quasi-steady at sp = 2, sf = 2", "transient", "5", "3.0e-04 Ubar"]
    assert "3.0e-04 Ubar" not in headline(statement, outlet)
    assert "| 3.0e-04 Ubar |" in headline([*statement, worse], outlet)
    off = ["1.5 d", "31", "rest", "0.2", "4.1, 4.2 d", "+0.010, -0.345 d", "", "", ""]
    assert "0.34 d at De = 31" in headline(statement, [*outlet, off])  # 0.345 in binary


def test_kept_statement_follows_from_the_kept_numbers():
    statement = (KEPT / "accuracy.md").read_text(encoding="utf-8")
    for kind in KINDS:
        rows = pd.read_csv(KEPT / f"{kind}.csv").drop(columns="error")
        for row in observed_orders(with_errors(rows, kind), kind).itertuples():
            assert f"| {row.deborah:g} | {row.default_error:.1e} Ubar" in statement


def test_requirements_on_the_default_settings_are_met():
    """Relative velocities converged to 1e-5 Ubar at De 1 and 5, Newtonian ones to 1e-7."""
    for kind in ("mesh", "order", "box"):
        table = with_errors(pd.read_csv(KEPT / f"{kind}.csv").drop(columns="error"), kind)
        default = table[table["default"]].groupby("deborah")["error"].max()
        assert default[0.0] < 1e-7
        assert default[1.0] < 1e-5
        assert default[5.0] < 1e-5


@pytest.mark.parametrize("kind", ["mesh", "order", "box"])
@pytest.mark.parametrize("geometry", ["1.1_sf1.1", "1.5_sf2.5", "4.5_sf1.5", "2_sf4.2"])
def test_requirements_on_high_deborah_numbers(geometry, kind):
    """`config/paper.yaml`: 1e-5 Ubar up to De = 10, then 2 % of the larger one."""
    table = pd.read_csv(KEPT / "high_deborah" / f"{kind}_sp{geometry}.csv")
    if (geometry, kind) == ("2_sf4.2", "order"):  # order 8 is not solved at De = 62
        table = table[table["deborah"] < 62]
    found = observed_orders(with_errors(table, kind), kind).set_index("deborah")
    assert found.loc[:10, "default_error"].max() < 1e-5
    assert found.loc[31:, "default_error_share"].max() < 0.02


def test_the_table_of_the_paper_between_its_distances():
    """Below 1e-5 Ubar at all De; at De = 62 the errors of simulations limit it."""
    check = pd.read_csv(KEPT / "paper_table" / "check.csv", comment="#")
    errors = check[["error_middle_minus_trailing", "error_leading_minus_middle"]].abs()
    largest = errors.max(axis=1).groupby(check["deborah"]).max()
    assert len(check) == 7 * 10
    assert largest.max() < 1e-5
