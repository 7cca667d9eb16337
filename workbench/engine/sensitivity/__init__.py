"""gradient: dG/dalpha of an objective along a trajectory, by the method of your choice.

discrete_adjoint          exact for the computed objective; the default; as cheap for any number of members
direct                    the same numbers by forward sensitivities of the scheme (DDM)
adjoint                   continuous adjoint (AVM), second order, systems without joints
constant_load             chapter IV, an estimate whose direction may be wrong
time_integration          chapter V with dS/dalpha; time_integration_without_ds drops the term
iterative                 chapter VI with true BDF2; _printed is (6.10), _truncated (6.45)
"""
