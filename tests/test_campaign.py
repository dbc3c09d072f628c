"""Draws of the campaign: the same for a seed and a number, in the ranges, and case files that are right."""

import signal

import pytest

from campaign import summary as campaign
from campaign.draws import LARGEST, Draw
from campaign.summary import PAGE, causes, code, effort, keep, kept, not_good, page, summary, table
from cutsim.cases import read_case


def test_a_seed_and_a_number_give_a_draw():
    draws = [Draw.of(3, number, 2, LARGEST[2]) for number in range(40)]
    assert draws == [Draw.of(3, number, 2, LARGEST[2]) for number in range(40)]
    assert len(set(draws)) == 40 and draws[0] != Draw.of(4, 0, 2, LARGEST[2])
    assert {d.motion for d in draws} == {"push", "retract", "re-insert"} and {d.notch for d in draws} == {True, False}
    assert all(0 <= d.friction <= 0.4 and 8 <= d.half_angle <= 25 and 0.3 <= d.strength <= 2 for d in draws)
    assert any(d.friction == 0 for d in draws)


@pytest.mark.parametrize("dim", [2, 3])
def test_case_files_are_right(dim, tmp_path):
    seen = set()
    for number in range(10):
        draw, path = Draw.of(1, number, dim, LARGEST[dim]), tmp_path / f"{number}.toml"
        path.write_text(draw.case("a cut"))
        case = read_case(path)
        assert case.law.toughness == pytest.approx(draw.toughness) and case.mesh.dim == dim
        assert draw.rule.size <= draw.radius and draw.bond.opening < 0.22
        seen.add((draw.motion, draw.law, draw.notch))
    assert len(seen) > 3


def cut(run, seconds, status=0, **found):
    good = {"verdict": "trusted", "closure": 1e-3, "penetration": {"crack_penetration": 0.1}, "cut": 2.0, "depth": 3.0}
    good |= {"doubts": [], "time": 3.0, "steps": 90, "rejected": 7, "code": "new"}
    body = {"young": 1.0, "poisson": 0.0, "toughness": 0.5, "friction": 0.0}
    return {
        "run": run,
        "class": "2-D, push, rough, notch",
        "dim": 2,
        "status": status,
        "seconds": seconds,
        **good,
        **body,
        **found,
    }


def test_a_summary_names_what_is_not_good():
    rows = [cut("a", 10.0), cut("b", 12.0), cut("c", 25.0, closure=0.02, cut=0.05), cut("d", 99.0, status=3)]
    doubted = {"verdict": "questionable", "doubts": ["notch: penetration"], "penetration": {"notch_penetration": 0.6}}
    rows.append(cut("e", 12.0, status=1, **doubted))
    words = "\n".join(summary(rows))
    for finding in (
        "4 of 5 come to their end, not d",
        "no equilibrium: d",
        "notch: penetration: e",
        "median of their class: c",
        "above 1%: c",
        "above 0.5 h: e",
        "trusted: e",
        "cost less: c",
    ):
        assert finding in words
    assert table(rows)[2] == "| 2-D, push, rough, notch | 5 | 4 | 3 | 0 | 3 | 3 | 12 | 2.0e-02 | 0.60 |"
    assert table(rows)[-1].startswith("| all | 5 | 4 |")


def test_each_cut_that_is_not_good_has_a_line_with_its_causes():
    out_of_time = cut("b", 240.0, status=-signal.SIGXCPU, time=1.5)
    rows = [cut("a", 10.0), out_of_time, cut("c", 10.0, status=1, doubts=["viscosity", "body: J"]), cut("d", 25.0)]
    assert [causes(row) for row in rows] == [[], ["out of time"], ["viscosity", "body: J"], []]
    killed = cut("e", 1.0, status=-signal.SIGKILL)
    assert causes(killed) == ["ended by SIGKILL"]
    del killed["depth"]  # it has made no step
    kind = "2-D, push, rough, notch"
    assert not_good([*rows, killed])[2:] == [
        f"| b | {kind} | out of time | 1.50 | 2.00 | 90 (7) | 240 |",
        f"| c | {kind} | viscosity, body: J | 3.00 | 2.00 | 90 (7) | 10 |",
        f"| d | {kind} | 2.5 times the median | 3.00 | 2.00 | 90 (7) | 25 |",
        f"| e | {kind} | ended by SIGKILL | – | – | – | 1 |",
    ]


def test_results_are_kept_with_the_state_of_the_code(tmp_path, monkeypatch):
    text = PAGE.read_text(encoding="utf-8")
    monkeypatch.setattr(campaign, "KEPT", tmp_path / "results")
    monkeypatch.setattr(campaign, "PAGE", tmp_path / "page.md")
    campaign.PAGE.write_text(text, encoding="utf-8")
    keep(3, [cut("2d-000", 10.0, code="one")])
    keep(4, [cut("2d-000", 10.0, code="two"), cut("2d-001", 30.0, code="two")])
    assert [row["run"] for row in kept()] == ["3/2d-000", "4/2d-000", "4/2d-001"]
    assert campaign.PAGE.read_text(encoding="utf-8") == page()
    assert "1 with state one of the code, 2 with state two of the code" in page() and "| 4/2d-001 | " in page()
    assert len(code()) == 10


def test_a_cut_that_costs_more_than_the_indentation_is_not_expected():
    """An indentation to 3 mm holds ¼ E · 3² = 2.25: 3 · 0.5 cost less, and with friction of 1.4 · 0.3 more."""
    rows = [cut("a", 10.0, cut=0.0), cut("b", 10.0, cut=0.0, friction=0.3)]
    assert effort(rows[0]) == pytest.approx(1.5 / 2.25) and effort(rows[1]) == pytest.approx(3 * 0.92 / 2.25)
    assert "cost less: a" in "\n".join(summary(rows)) and table(rows)[2].startswith(
        "| 2-D, push, rough, notch | 2 | 2 | 0 | 1 | 2 |"
    )


def test_the_page_has_the_table_of_the_results_that_are_kept():
    assert kept() and page() == PAGE.read_text(encoding="utf-8")
    for row in kept():
        draw = Draw(**{name: row[name] for name in Draw.__dataclass_fields__})
        assert draw.kind == row["class"]
