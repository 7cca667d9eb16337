"""Whole belts beside belts in fractions: mirror images, what is judged, what is told."""

import numpy as np

from studies import gunner_whole_belts as whole_belts
from studies.gunner.cabin.facing import HATCH
from studies.gunner.restraints.ground_structure import sites
from studies.gunner.restraints.model import restraint
from studies.gunner_whole_belts import curve, lines, main
from studies.whole_under_attack import Counted
from workbench.engine.layout.formulation.groups import mirrored


def pairs():
    geometry = restraint(airbags=0.0).problem([{}]).geometry
    return mirrored(geometry, axis=1, at=float(HATCH[1]))


def test_belts_have_their_mirror_images_in_the_plane_of_the_hatch():
    """30 members of the ground structure stand in that plane, 150 are 75 pairs (note, section 12)."""
    found = pairs()
    assert len(found) == 75
    for i, j in found:
        one, other = sites()[i], sites()[j]
        assert (one.layer, one.segment) == (other.layer, other.segment)
        assert {one.side, other.side} in ({"left", "right"}, {"front"}, {"back"})


def some(count, whole=0.4):
    density = np.zeros(180)
    density[:count] = 1.0
    return Counted(
        count=count, uniform=1.0, fractions=0.32, whole=whole, stated=(0.32, 0.4), beyond=(0.0, 0.015),
        whole_density=density, anchors=3, status="LIMIT",
    )  # fmt: skip


def test_lines_tell_the_price_and_which_belts(monkeypatch, capsys, tmp_path):
    first, second = lines(some(4))
    assert first.startswith(
        "  4 belts  spread evenly 1.0000  in fractions 0.3200  whole 0.4000 m  price 25.0 %"
    )
    assert "4 on, 3 anchors  outsider beyond 0.0, 1.5 %  LIMIT" in first
    assert second.split(", ")[0].strip().startswith("front upper layer 1 (no. 1)")
    (ax,) = curve([some(4), some(8, 0.35)]).axes
    assert [line.get_label() for line in ax.lines] == [
        "spread evenly",
        "in fractions",
        "whole, in mirror images",
    ]
    assert ax.lines[2].get_ydata().tolist() == [0.4, 0.35]
    asked = {}
    monkeypatch.setattr(
        whole_belts, "count_belts", lambda counts, **given: asked.update(counts=counts, **given) or [some(4)]
    )
    monkeypatch.setattr(
        "sys.argv", ["whole_belts", "4,6", "--outsider", "33", "--rounds", "2", "--folder", str(tmp_path)]
    )
    main()
    assert (asked["counts"], asked["effort"].outsider, asked["effort"].rounds) == ((4, 6), 33, 2)
    assert (tmp_path / "gunner_whole_belts.png").exists()
    assert "price 25.0 %" in capsys.readouterr().out
