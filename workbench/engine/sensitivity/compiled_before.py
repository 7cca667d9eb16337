"""Whether this installation has compiled an adjoint before: the first one takes some twenty seconds."""

__all__ = ["an_adjoint_is_compiled"]


def an_adjoint_is_compiled() -> bool:
    """Whether the machine code of a transient adjoint, of whatever kind of system, is kept on disk by now."""
    from ..compiler.cache import is_kept
    from ..integration._kernels.independent import independent_adjoint
    from ..planar._kernels.alpha_adjoint import alpha_adjoint
    from ..tree._kernels.alpha_adjoint import sweep

    return any(is_kept(kernel) for kernel in (alpha_adjoint, sweep, independent_adjoint))
