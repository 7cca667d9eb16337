# mypy: ignore-errors
"""Generalised-alpha on the group of a tree's joints, compiled (Bruels & Cardona 2010; Arnold, Bruels &
Cardona 2015), with the states in the first-order form of the same family (Jansen, Whiting & Hulbert 2000).

    (1 - am) a1 + am a = (1 - af) w1 + af w,     v1 = v + h ((1 - g) a + g a1)
    d = h v + h^2 ((1/2 - b) a + b a1),          q1 = q exp(d)
    r(q1, v1, w1) = 0;   Newton:  (M + h g c C + h^2 b c K T(d)) dw = -r,  c = (1 - af)/(1 - am)

Where steps change their length, a, which belongs to a time beside its node's, is moved along with it before
the step: a <- w + (h/h_before) (a - w). Without that the order is 1.

States stand behind the velocities and have no place of their own. Multipliers of cut joints stand behind the
states as unknowns w whose rows say phi(q1)/(h^2 b c) = 0 (index 3, scaled); at the start phi'' = 0. Factors
are used until the iteration contracts badly; where the tangents at the converged nodes are kept for the
adjoint, their factors serve the next step, and a last step of Newton's with them, which costs a solution,
takes the place of one or two with older factors. Where that does not settle, Newton's steps are damped.
"""

from numba import njit

from ...compiler.options import CALLED, CAREFUL, INNER
from .elimination import factor, solve
from .forces import evaluate
from .motion import moved
from .rotations import tangent

SPHERICAL = 3
FLOOR = 1e-9  # updates this small, and no longer shrinking, are rounding
SLOW = 0.2  # contraction of the updates above which the factors are renewed
LEAST = 1.0  # m/s^2 or rad/s^2: at rest rounding of the forces leaves accelerations that mean nothing
STRETCHED = 1.2  # change of the step's length beyond which factors are renewed at once
ROUND = 4e-15  # m or rad: rounding of a condition
SHORTEST = 1e-4  # of a Newton step: damped further it leads nowhere
NEARLY = 10.0  # times the tolerance: so near, the last step with new factors leads to rounding
FAR = 1e20  # times the largest acceleration so far: Newton diverges, and powers of it would overflow
LOST = -2


@njit(**INNER)
def newton_matrix(T, W, d, by_v, by_q, out):
    """out = M + by_v C + by_q K T(d)."""
    n = W.m.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = W.m[i, j] + by_v * W.c[i, j] + by_q * W.k[i, j]
    t = W.small[0]
    for l in range(T.link.shape[0]):
        if T.link[l, 0] == SPHERICAL:
            j = T.link[l, 2]
            tangent(d, j, t)
            for e in range(3):
                t[e, e] -= 1.0
            for i in range(n):
                x, y, z = by_q * W.k[i, j], by_q * W.k[i, j + 1], by_q * W.k[i, j + 2]
                for e in range(3):
                    out[i, j + e] += x * t[0, e] + y * t[1, e] + z * t[2, e]


@njit(**INNER)
def start(T, W, P, R, lu, node, kept):
    """Consistent rates at node 0 (a value, no literal: see `evaluate`); W.m's factors in lu."""
    q, v, w, tangent = R.position[0], R.velocity[0], R.rate[0], node == 0
    n = W.m.shape[0]
    for i in range(n):
        w[i] = 0.0
    evaluate(T, W, node, q, v, w, tangent)
    newton_matrix(T, W, w, 0.0, 0.0, lu)
    if factor(P, lu, R.diagonal) != 0:
        return False
    for i in range(n):
        R.right[i] = -W.force[i]
    solve(P, lu, R.right)
    for i in range(n):
        w[i] = R.right[i]
        R.a[i] = w[i]
    if kept:
        evaluate(T, W, node, q, v, w, tangent)
        keep(W, R, node)
    return True


@njit(**INNER)
def keep(W, R, node):
    """Store the tangents of a node."""
    n = W.m.shape[0]
    for i in range(n):
        for j in range(n):
            R.stiffness[node, i, j] = W.k[i, j]
            R.damping[node, i, j] = W.c[i, j]


@njit(**CALLED)
def begun(T, R, numbers, grid, node, extrapolated):
    """The first guess of a step: accelerations on the line through the last two nodes, or as they were.

    `extrapolated` comes as a comparison of numbers: for a literal of its own type all would be compiled anew.
    """
    am, af, gamma, beta = numbers[0], numbers[1], numbers[2], numbers[3]
    c = (1.0 - af) / (1.0 - am)
    h, ratio, along = grid[0, node], grid[0, node] / grid[0, node - 1], grid[1, node]
    if not extrapolated:
        ratio = 0.0
    w0, v0 = R.rate[node - 1], R.velocity[node - 1]
    v, w, d, before = R.velocity[node], R.rate[node], R.move[node], R.rate[max(node - 2, 0)]
    for i in range(w.shape[0]):
        w[i] = (1.0 + ratio) * w0[i] - ratio * before[i]
        R.a[i] = along * R.before[i] + (1.0 - along) * w0[i]
        base = (af * w0[i] - am * R.a[i]) / (1.0 - am) + c * w[i]
        v[i] = v0[i] + h * ((1.0 - gamma) * R.a[i] + gamma * base)
        d[i] = h * v0[i] + h * h * ((0.5 - beta) * R.a[i] + beta * base)
    moved(T, R.position[node - 1], d, R.position[node])


@njit(**INNER)
def carried(R, numbers, node):
    """The auxiliary accelerations behind a step that is made."""
    am, af = numbers[0], numbers[1]
    c = (1.0 - af) / (1.0 - am)
    w0, w = R.rate[node - 1], R.rate[node]
    for i in range(w.shape[0]):
        R.a[i] = (af * w0[i] - am * R.a[i]) / (1.0 - am) + c * w[i]


@njit(**INNER)
def completed(T, W, P, R, numbers, grid, node):
    """The last Newton step: with the residual and the factors of a node that is all but solved."""
    am, af, gamma, beta = numbers[0], numbers[1], numbers[2], numbers[3]
    c = (1.0 - af) / (1.0 - am)
    h = grid[0, node]
    v, w, d = R.velocity[node], R.rate[node], R.move[node]
    for i in range(w.shape[0]):
        R.right[i] = -W.force[i]
    solve(P, R.lu, R.right)
    for i in range(w.shape[0]):
        x = c * R.right[i]
        w[i] += R.right[i]
        v[i] += h * gamma * x
        d[i] += h * h * beta * x
        R.a[i] += x
    moved(T, R.position[node - 1], d, R.position[node])


@njit(**INNER)
def one_step(T, W, P, R, numbers, grid, node, limit, count, fresh):
    """Solve for node; the factors to begin with are in R.lu. Returns the Newton steps, or -1.

    grid: lengths of the steps and the factors of a, as from `step_changes`.
    """
    am, af, gamma, beta = numbers[0], numbers[1], numbers[2], numbers[3]
    c = (1.0 - af) / (1.0 - am)
    h = grid[0, node]
    by_v, by_q = h * gamma * c, h * h * beta * c
    n, joints = W.m.shape[0], T.column.shape[0]
    conditions = n - T.cut.shape[0]
    floor = max(FLOOR, ROUND * T.closing[node] / R.level[0])
    q0, q, v, w, d = R.position[node - 1], R.position[node], R.velocity[node], R.rate[node], R.move[node]
    begun(T, R, numbers, grid, node, node > 0)
    far, far_state = FAR * R.level[0], FAR * R.level[1]
    old, rate = -1.0, 1.0
    for step in range(1, count + 1):
        evaluate(T, W, node, q, v, w, fresh)
        if fresh:
            newton_matrix(T, W, d, by_v, by_q, R.lu)
            R.counts[1] += 1
            if factor(P, R.lu, R.diagonal) != 0:
                return LOST
            fresh = False
        for i in range(n):
            R.right[i] = -W.force[i]
        solve(P, R.lu, R.right)
        size = 0.0
        for i in range(n):
            x = R.right[i]
            w[i] += x
            v[i] += by_v * x
            d[i] += by_q * x
            level = R.level[0] if i < joints else R.level[1]
            if i >= conditions:
                continue  # multipliers follow the accelerations
            if i < joints and abs(w[i]) > R.level[0]:
                R.level[0] = abs(w[i])
            elif i >= joints and abs(w[i]) > R.level[1]:
                R.level[1] = abs(w[i])
            size = max(size, abs(x) / level)
        moved(T, q0, d, q)
        R.counts[0] += 1
        if not (size < FAR and R.level[0] < far and R.level[1] < far_state):
            return -1
        if old >= 0.0:
            rate = size / old if old > 0.0 else 0.0
        if size == 0.0 or (rate < 1.0 and size * rate <= limit) or (size <= floor and rate > 0.3):
            carried(R, numbers, node)
            return step
        if old >= 0.0 and rate > SLOW:
            fresh = True
            old = -1.0
            rate = 1.0
        else:
            old = size
    return -1


@njit(**INNER)
def shifted(T, R, by_v, by_q, node, by):
    """Move the guess of a step along R.correction."""
    v, w, d = R.velocity[node], R.rate[node], R.move[node]
    for i in range(w.shape[0]):
        x = by * R.correction[i]
        w[i] += x
        v[i] += by_v * x
        d[i] += by_q * x
    moved(T, R.position[node - 1], d, R.position[node])


@njit(**INNER)
def solved_size(W, P, R, joints, conditions):
    """R.right = -A^-1 r with the factors in R.lu, and its size; multipliers follow the accelerations."""
    n, size = W.m.shape[0], 0.0
    for i in range(n):
        R.right[i] = -W.force[i]
    solve(P, R.lu, R.right)
    for i in range(conditions):
        size = max(size, abs(R.right[i]) / R.level[0 if i < joints else 1])
    return size


@njit(**INNER)
def damped_step(T, W, P, R, numbers, grid, node, limit, count):
    """Solve for node by Newton's method with new slopes at every step, each as long as the next correction
    by the same slopes becomes smaller (Deuflhard 2004, 3.3). Returns the Newton steps, or -1.

    It begins at the accelerations as they were: where a contact comes in, the line through the last two nodes
    points far beyond.
    """
    am, af, gamma, beta = numbers[0], numbers[1], numbers[2], numbers[3]
    c = (1.0 - af) / (1.0 - am)
    h = grid[0, node]
    by_v, by_q = h * gamma * c, h * h * beta * c
    n, joints = W.m.shape[0], T.column.shape[0]
    conditions = n - T.cut.shape[0]
    floor = max(FLOOR, ROUND * T.closing[node] / R.level[0])
    q, v, w, d = R.position[node], R.velocity[node], R.rate[node], R.move[node]
    tangent, share = node > 0, 1.0
    begun(T, R, numbers, grid, node, node < 0)
    for step in range(1, count + 1):
        evaluate(T, W, node, q, v, w, tangent)
        newton_matrix(T, W, d, by_v, by_q, R.lu)
        R.counts[1] += 1
        if factor(P, R.lu, R.diagonal) != 0:
            return LOST
        size = solved_size(W, P, R, joints, conditions)
        if not size < FAR:
            return -1
        for i in range(n):
            R.correction[i] = R.right[i]
        share = min(1.0, 2.0 * share)
        shifted(T, R, by_v, by_q, node, share)
        left = size
        while size > 0.0:
            R.counts[0] += 1
            evaluate(T, W, node, q, v, w, not tangent)
            left = solved_size(W, P, R, joints, conditions)
            if left <= (1.0 - 0.25 * share) * size or size <= floor:
                break
            if share < SHORTEST:
                return -1
            shifted(T, R, by_v, by_q, node, -0.5 * share)
            share *= 0.5
        if size == 0.0 or (share == 1.0 and (left <= limit or (size <= floor and left > 0.3 * size))):
            for i in range(conditions):
                part = 0 if i < joints else 1
                R.level[part] = max(R.level[part], abs(w[i]))
            carried(R, numbers, node)
            return step
    return -1


@njit(**INNER)
def undone(R, level, level_of_states):
    """Back to before the step that failed."""
    for i in range(R.a.shape[0]):
        R.a[i] = R.before[i]
    R.level[0] = level
    R.level[1] = level_of_states
    R.level[2] = 1.0


@njit(**CAREFUL)
def march(T, W, P, R, numbers, grid, limit, count, known):
    """All nodes from R.position[0], R.velocity[0] over the steps of `grid`, see `step_changes`.

    known: nodes that an earlier run left, with a, level and lu as they are then in R; 0: the rates at node 0
    are found first.  On return R.level[2] says whether the next step would renew the factors.
    Returns the number of the node that failed (negative: for want of a pivot; minus their count: at the
    start), or 0. Where a node failed, R stands where the node before left it, so its step may be made again
    otherwise. Tangents are kept where R has room for them.
    """
    kept = R.stiffness.shape[0] > 1
    n, nodes = W.m.shape[0], R.position.shape[0]
    tangent = nodes > 0
    if known == 0:
        R.level[0] = LEAST
        R.level[1] = LEAST
        R.level[2] = 1.0
        if not start(T, W, P, R, R.factors[0], nodes - nodes, kept):
            return -nodes
    am, af, gamma, beta = numbers[0], numbers[1], numbers[2], numbers[3]
    c = (1.0 - af) / (1.0 - am)
    fresh = R.level[2] > 0.0
    near = NEARLY * limit if kept else limit
    for node in range(max(known, 1), nodes):
        before, level, level_of_states = R.counts[0], R.level[0], R.level[1]
        for i in range(n):
            R.before[i] = R.a[i]
        h, ratio = grid[0, node], grid[0, node] / grid[0, node - 1]
        fresh = fresh or ratio > STRETCHED or ratio * STRETCHED < 1.0
        taken = one_step(T, W, P, R, numbers, grid, node, near, count, fresh)
        if taken < 0:
            undone(R, level, level_of_states)
            taken = damped_step(T, W, P, R, numbers, grid, node, limit, count)
        if taken < 0:
            undone(R, level, level_of_states)
            return -node if taken == LOST else node
        fresh = R.counts[0] - before > 5
        if kept:
            q, v, w = R.position[node], R.velocity[node], R.rate[node]
            evaluate(T, W, node, q, v, w, tangent)
            newton_matrix(T, W, R.move[node], h * gamma * c, h * h * beta * c, R.lu)
            R.counts[1] += 1
            if factor(P, R.lu, R.diagonal) != 0:
                undone(R, level, level_of_states)
                return -node
            keep(W, R, node)
            for i in range(n):
                for j in range(n):
                    R.factors[node, i, j] = R.lu[i, j]
            completed(T, W, P, R, numbers, grid, node)
            fresh = False
    R.level[2] = 1.0 if fresh else 0.0
    return 0


@njit(**CAREFUL)
def tangents_again(T, W, P, R, numbers, grid, first, stiffness, damping, factors):
    """Tangents and factors of the nodes first, first + 1, ... of a run that did not keep them; 0, or the node
    whose factors are lost.
    """
    am, af, gamma, beta = numbers[0], numbers[1], numbers[2], numbers[3]
    c = (1.0 - af) / (1.0 - am)
    n = W.m.shape[0]
    for i in range(stiffness.shape[0]):
        node = first + i
        h = grid[0, node]
        evaluate(T, W, node, R.position[node], R.velocity[node], R.rate[node], node >= 0)
        if node:
            newton_matrix(T, W, R.move[node], h * gamma * c, h * h * beta * c, factors[i])
        else:
            newton_matrix(T, W, R.move[0], 0.0, 0.0, factors[i])
        if factor(P, factors[i], R.diagonal) != 0:
            return node
        for a in range(n):
            for b in range(n):
                stiffness[i, a, b] = W.k[a, b]
                damping[i, a, b] = W.c[a, b]
    return 0
