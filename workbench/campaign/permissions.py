"""What a person allows when a study changed under its stored runs; without a word, the campaign refuses."""

from dataclasses import dataclass

__all__ = ["Permissions"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Permissions:
    """Each is one answer to one refusal.

    same_model: the changed model gives the same results; stored runs go on serving, and that is recorded.
    new_version: runs of the changed model are made anew, the old ones stay apart.
    run_again: runs from which a response cannot be read are made anew.
    at_baseline: runs made before a parameter was added were made at its baseline.
    """

    same_model: bool = False
    new_version: bool = False
    run_again: bool = False
    at_baseline: bool = False
