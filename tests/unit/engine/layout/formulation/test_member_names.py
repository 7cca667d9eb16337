"""What members are called: by their own names, or by kind and number."""

import pytest

from workbench.engine.layout.formulation.member_names import member_names


def test_members_of_a_kind_are_numbered_whether_others_of_it_have_a_name_or_not():
    names = member_names(["spring", "belt", "spring", "spring"], ["", "", "left strut", ""])
    assert names == ("spring 1", "belt 1", "left strut", "spring 3")


def test_without_any_name_all_are_numbered():
    assert member_names(["belt", "belt"]) == ("belt 1", "belt 2")


def test_as_many_names_as_members():
    with pytest.raises(ValueError, match="shorter"):
        member_names(["belt", "belt"], ["lap"])
