"""Draws of the campaign: the same for a seed and a number, in the ranges, and case files that are right."""

import pytest

from campaign.draws import LARGEST, Draw
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
