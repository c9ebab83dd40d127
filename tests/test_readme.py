"""The accuracy statement of the README: that of the verification, from the kept numbers."""

import pandas as pd
import pytest
from harness import ROOT
from readme_accuracy import KEPT, with_statement

from viscotrain.studies.accuracy import KINDS, observed_orders, with_errors

README = ROOT / "README.md"


def test_readme_holds_the_kept_statement():
    text = README.read_text(encoding="utf-8")
    assert with_statement(text) == text


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
def test_requirements_on_high_deborah_numbers(kind):
    """`config/paper.yaml` at (4.5, 1.5): 1e-5 Ubar up to De = 10, then 2 % of the larger one."""
    table = pd.read_csv(KEPT / "high_deborah" / f"{kind}_sp4.5_sf1.5.csv")
    found = observed_orders(with_errors(table, kind), kind).set_index("deborah")
    assert found.loc[:10, "default_error"].max() < 1e-5
    assert found.loc[[31, 62], "default_error_share"].max() < 0.02
