"""The loop of the dissertation's figure 8.26: a deck is written, a solver runs, a request file is read.

    pre-processor      deck.adm.tmpl with the parameters filled in       -> deck.adm
    solver             solver.py, a stand-in: torso and head held by a belt on a seat that stops
    post-processor     the histories in deck.req, reduced to peaks

The formats are like those of ADAMS (statements with a slash, blocks of requests) but are not ADAMS's own:
the stand-in keeps the whole path testable without a licence. Run it with
`holdfast run studies/adams_loop/loop.toml`.
"""

__all__: list[str] = []
