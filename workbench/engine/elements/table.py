"""The tables of the member laws and of the force elements between bodies.

A member law is a record of parameters and three kernels (`forces`, `energies`, `parameter_slopes`) in a file
of its own, named in `LAWS`; a force element is one likewise, as `element` says, named in `ELEMENTS`. Kernels,
tables and public names read these tables.
"""

__all__ = ["ELEMENTS", "LAWS", "PARAMETERS", "USER", "code_of"]

# record -> file; the place in the table is the code of the law, and segments of members are sorted by it
LAWS = {
    "Spring": "spring", "Contact": "contact", "Impulse": "impulse", "Belt": "belt", "Airbag": "airbag",
    "Timed": "timed", "Webbing": "webbing", "LockingRetractor": "locking_retractor",
    "VentedAirbag": "vented_airbag", "Curve": "curve", "CompiledLaw": "compiled_law",
}  # fmt: skip
# record -> file; the place in the table is the code of the element
ELEMENTS = {"JointSpring": "joint_spring", "Bushing": "bushing"}
USER = 99  # code of laws written in Python, behind all others
PARAMETERS = 30  # most parameters of a law: those of a curve of fourteen points


def code_of(name: str) -> int:
    """The code of a law or an element in the tables of the kernels. Raises ValueError for others."""
    return list(LAWS if name in LAWS else ELEMENTS).index(name)
