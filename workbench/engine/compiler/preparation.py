# mypy: ignore-errors
"""numba's passes between byte code and types, without the lives of variables.

numba finds out after each of its passes where every variable begins and ends to live, and at last writes down
where it is deleted. That is for generators and for counts of references: kernels have neither.
"""

from numba.core.compiler_machinery import register_pass
from numba.core.ir_utils import build_definitions
from numba.core.rewrites import rewrite_registry
from numba.core.ssa import reconstruct_ssa
from numba.core.transforms import canonicalize_cfg
from numba.core.typed_passes import PreLowerStripPhis
from numba.core.untyped_passes import GenericRewrites, IRProcessing, ReconstructSSA

__all__ = ["AssignedOnce", "InOrder", "Rewritten", "WithoutPhis"]


@register_pass(mutates_CFG=True, analysis_only=False)
class InOrder(IRProcessing):
    """Loops with one way back each."""

    _name = "in_order"

    def run_pass(self, state):
        """As numba's."""
        state.func_ir.blocks = canonicalize_cfg(state.func_ir.blocks)
        state.func_ir.generator_info = None
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class Rewritten(GenericRewrites):
    """Constant indices and what else numba rewrites before types are known."""

    _name = "rewritten"

    def run_pass(self, state):
        """As numba's `rewrite_registry.apply`."""
        blocks = state.func_ir.blocks
        for kind in rewrite_registry.rewrites["before-inference"]:
            rewrite, left = kind(state), list(blocks.items())
            while left:
                key, block = left.pop()
                if rewrite.match(state.func_ir, block, state.typemap, state.calltypes):
                    blocks[key] = rewrite.apply()
                    left.append((key, blocks[key]))
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class AssignedOnce(ReconstructSSA):
    """Variables that are assigned once."""

    _name = "assigned_once"

    def run_pass(self, state):
        """As numba's."""
        state.func_ir = reconstruct_ssa(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class WithoutPhis(PreLowerStripPhis):
    """What paths bring together is assigned at their ends."""

    _name = "without_phis"

    def run_pass(self, state):
        """As numba's."""
        state.func_ir = self._strip_phi_nodes(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True
