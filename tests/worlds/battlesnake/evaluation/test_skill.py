"""OpenSkill's scale: what a newcomer is worth by its definition, and the package itself, game after game."""

import pytest
from openskill.models import PlackettLuce

from racecraft.evaluation.rating import Result
from racecraft.worlds.battlesnake.evaluation.skill import SkillBook, skills


def test_a_newcomer_stands_at_25_and_its_interval_is_1_96_sigma_to_both_sides():
    """Sigma begins at 25/3, as the package has it."""
    (one,) = skills(1, [])
    half = 1.96 * 25 / 3
    assert (one.mu, one.low, one.high) == pytest.approx((25.0, 25.0 - half, 25.0 + half))


def test_skills_are_those_of_the_package_game_after_game():
    games = [Result((0, 2, 1), (0, 1, 1)), Result((1, 0), (0, 1)), Result((3, 1), (0, 0))]
    model = PlackettLuce()
    known = [model.rating() for _ in range(4)]
    for game in games:
        teams = model.rate([[known[one]] for one in game.players], ranks=[*map(float, game.places)])
        for one, (rated,) in zip(game.players, teams, strict=True):
            known[one] = rated
    found = skills(5, games)
    assert [one.mu for one in found[:4]] == pytest.approx([one.mu for one in known])
    widths = [one.high - one.low for one in found[:4]]
    assert widths == pytest.approx([2 * 1.96 * one.sigma for one in known])
    assert found[4] == skills(1, [])[0]


def test_who_comes_later_begins_as_everybody_did():
    book = SkillBook()
    book.hear(Result((0, 1), (0, 1)))
    assert book.skill(7) == SkillBook().skill(0)
    assert book.skill(0).mu > book.skill(7).mu > book.skill(1).mu
