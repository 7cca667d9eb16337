# mypy: ignore-errors
"""mu^T dr/dp summed over the nodes of a run, compiled; and the motions of all links for quantities.

A row of adjoint multipliers mu moves the links with the virtual twists V = S mu. A member's tension works on
the virtual rate of its length, so mu^T dr/dscale = f u . (virtual velocity of a's point less that of b's).
"""

from numba import njit

from ...compiler.held import only_with
from ...compiler.options import CAREFUL, INNER
from ...elements._kernels_laws import elastic, held_energies, held_parameter_slopes
from ...elements._kernels_spatial_bushing import spatial_bushing
from ...elements.joint_spring import torque_slopes
from ...elements.spring import energies as spring_energies
from .elements import bushing_state, coordinate_forces, pair_forces
from .members import SPRING, measure_members, unit_forces
from .motion import columns, inertia_times, joint_forces, link_wrenches, places, twists
from .rotations import logarithm, turned_back

TINY = 1e-30


@njit(**INNER)
def virtual_twists(T, W, mu, V):
    """V (L + 1, 6) = S mu of every link; the ground's is zero."""
    for l in range(T.link.shape[0]):
        parent = T.link[l, 1]
        for e in range(6):
            V[l, e] = V[parent, e]
        for k in range(T.link[l, 2], T.link[l, 2] + T.link[l, 3]):
            for e in range(6):
                V[l, e] += W.s[k, e] * mu[k]


@njit(**INNER)
def virtual_rate(line, A, B):
    """Rate of a member's length under the virtual twists of its links."""
    ax, ay, az, bx, by, bz = line[0], line[1], line[2], line[3], line[4], line[5]
    x = A[3] + A[1] * az - A[2] * ay - (B[3] + B[1] * bz - B[2] * by)
    y = A[4] + A[2] * ax - A[0] * az - (B[4] + B[2] * bx - B[0] * bz)
    z = A[5] + A[0] * ay - A[1] * ax - (B[5] + B[0] * by - B[1] * bx)
    return line[6] * x + line[7] * y + line[8] * z


@njit(**CAREFUL)
def contract(T, W, R, starts, mu, V, gradient):
    """gradient (rows, N) += slopes by the scales."""
    for node in range(starts[0] + 1):
        places(T, W, node, R.position[node])
        columns(T, W)
        twists(T, W, node, R.velocity[node], R.rate[node])
        measure_members(T, W, node)
        for row in range(starts.shape[0]):
            if starts[row] < node:
                continue
            virtual_twists(T, W, mu[node, row], V)
            for g in range(T.segment.shape[0]):
                pair = T.segment[g, 0]
                A, B = V[T.pair[pair, 0]], V[T.pair[pair, 1]]
                for i in range(T.segment[g, 2], T.segment[g, 3]):
                    gradient[row, i] += W.f[i] * virtual_rate(W.line[i], A, B)


@njit(**CAREFUL)
def contract_parameters(
    T, W, R, last, mu, V, law, length, points, spring, ball, coupling, bushing, inertia, dp, six, own
):
    """Slopes of a row by laws (PARAMETERS, N), natural lengths, points of members (6, N), springs (8, T),
    balls (2, B), couplings (3, C), bushings (15, U) and the links' inertias (10, L).

    Scratch dp (PARAMETERS,), six (3, 6), own (26, 1) complex.
    """
    for node in range(last + 1):
        q, v = R.position[node], R.velocity[node]
        places(T, W, node, q)
        columns(T, W)
        twists(T, W, node, v, R.rate[node])
        measure_members(T, W, node)
        m = mu[node]
        virtual_twists(T, W, m, V)
        for g in range(T.segment.shape[0]):
            pair, code = T.segment[g, 0], T.segment[g, 1]
            A, B = V[T.pair[pair, 0]], V[T.pair[pair, 1]]
            for i in range(T.segment[g, 2], T.segment[g, 3]):
                along = T.scale[i] * virtual_rate(W.line[i], A, B)
                length[i] -= W.fd[i] * along
                for j in range(dp.shape[0]):
                    dp[j] = 0.0
                if code == SPRING:
                    dp[0] = W.delta[i]
                    dp[1] = W.rate[i]
                else:
                    other_parameters(T, W, code, i, T.times[node], dp)
                for j in range(dp.shape[0]):
                    law[j, i] += dp[j] * along
                point_slopes(T, W, pair, i, A, B, points)
        spring_slopes(T, q, v, m, six[0], dp, spring)
        ball_slopes(T, q, v, m, six[0], ball)
        coupling_slopes(T, q, v, m, coupling)
        bushings_slopes(T, W, v, V, m, own, bushing)
        for l in range(T.link.shape[0]):
            inertia_slopes(W, l, V[l], six, inertia)


@njit(**INNER)
def point_slopes(T, W, pair, i, A, B, points):
    """points (6, N) += slopes of a member's virtual power s f p by its points on a and b, in links' axes.

    p = u . g~, g~ the virtual velocity of a's point less that of b's, rate = u . g likewise:
    d/dr_a = s [fd u + fv ((g - rate u)/l + u x w_a)] p + s f [(g~ - p u)/l + u x W_a].
    """
    a, b = T.pair[pair, 0], T.pair[pair, 1]
    line, u, some = W.line[i], W.line[i, 6:], W.some[3]
    p = virtual_rate(line, A, B)
    l = W.delta[i] + T.geometry[6, i]
    fd, fv, f = T.scale[i] * W.fd[i] * p, T.scale[i] * W.fv[i] * p, T.scale[i] * W.f[i]
    for e in range(3):
        c, d = (e + 1) % 3, (e + 2) % 3
        # components of g and g~
        g = point_rate(W.twist[a], line, e, 0) - point_rate(W.twist[b], line, e, 3)
        h = point_rate(A, line, e, 0) - point_rate(B, line, e, 3)
        both = fd * u[e] + (fv * (g - W.rate[i] * u[e]) + f * (h - p * u[e])) / l
        va, vb = W.twist[a], W.twist[b]
        some[e] = both + fv * (u[c] * va[d] - u[d] * va[c]) + f * (u[c] * A[d] - u[d] * A[c])
        some[3 + e] = -both - fv * (u[c] * vb[d] - u[d] * vb[c]) - f * (u[c] * B[d] - u[d] * B[c])
    for e in range(3):
        for k in range(3):
            points[e, i] += W.turn[a, 3 * k + e] * some[k]
            points[3 + e, i] += W.turn[b, 3 * k + e] * some[3 + k]


@njit(**INNER)
def point_rate(twist, line, e, at):
    """Component e of the velocity of the point line[at:at + 3]."""
    c, d = (e + 1) % 3, (e + 2) % 3
    return twist[3 + e] + twist[c] * line[at + d] - twist[d] * line[at + c]


@only_with("other_law")
def other_parameters(T, W, code, i, t, dp):
    """Slopes of a member's unit force by the parameters of another law than a spring."""
    held_parameter_slopes(T.other_law, code, T.law, i, W.delta[i], W.rate[i], t, dp)


@only_with("other_law")
def other_energies(T, W, code, first, last, t, energy):
    """Energies of members of another law than a spring, at unit density."""
    held_energies(T.other_law, code, T.law, first, last, W.delta, t, energy)


@only_with("spring_column")
def spring_slopes(T, q, v, m, big, dp, spring):
    """spring (8, T) += slopes by k, c, rest, k_stop, upper, lower, ., torque."""
    for t in range(T.spring_column.shape[0]):
        j, at = T.spring_column[t, 0], T.spring_column[t, 1]
        big[2] = q[at]
        big[5] = v[j]
        torque_slopes(T.spring, t, big, dp)
        for e in range(6):
            spring[e, t] += dp[e] * m[j]
        spring[7, t] -= m[j]


@only_with("ball_column")
def ball_slopes(T, q, v, m, turn, ball):
    """ball (2, B) += slopes by k, c."""
    for t in range(T.ball_column.shape[0]):
        j, at = T.ball_column[t, 0], T.ball_column[t, 1]
        logarithm(q, at, T.ball_rest, t, turn)
        for e in range(3):
            ball[0, t] += turn[e] * m[j + e]
            ball[1, t] += v[j + e] * m[j + e]


@only_with("coupling_column")
def coupling_slopes(T, q, v, m, coupling):
    """coupling (3, C) += slopes by k, c, rest."""
    for t in range(T.coupling_column.shape[0]):
        i, j = T.coupling_column[t, 0], T.coupling_column[t, 1]
        a, b = T.coupling_column[t, 2], T.coupling_column[t, 3]
        work = m[i] - m[j]
        coupling[0, t] += (q[a] - q[b] - T.coupling[t, 2]) * work
        coupling[1, t] += (v[i] - v[j]) * work
        coupling[2, t] -= T.coupling[t, 0] * work


@only_with("bushing_pair")
def bushings_slopes(T, W, v, V, m, own, bushing):
    """`bushing_slopes` of all."""
    for u in range(T.bushing_pair.shape[0]):
        bushing_slopes(T, W, u, v, V, m, own, bushing)


@njit(**INNER)
def bushing_slopes(T, W, u, velocity, V, m, own, bushing):
    """bushing (15, U) += mu^T dr/dp by the first 15 numbers of a bushing, by complex steps of the law."""
    n = T.column.shape[0]
    pair, state = T.bushing_pair[u, 0], T.bushing_pair[u, 1]
    A, B = V[T.pair[pair, 0]], V[T.pair[pair, 1]]
    r, v, point, y, some = W.some[2], W.some[2, 3:], W.some[2, 12:], W.some[2, 15:], W.some[2, 18:]
    bushing_state(T, W, u, r, v, point)
    z = 0.0 * r[0]
    if state >= 0:
        z = velocity[n + state]
    # the force works on the virtual velocity of a's point against b, in b's axes
    a, b, c = A[0] - B[0], A[1] - B[1], A[2] - B[2]
    some[0] = A[3] - B[3] + b * point[2] - c * point[1]
    some[1] = A[4] - B[4] + c * point[0] - a * point[2]
    some[2] = A[5] - B[5] + a * point[1] - b * point[0]
    turned_back(W.turn[T.pair[pair, 1]], some, y)
    Z = W.complex
    f, out, fz, gr = Z[0, 0], Z[0, 1], Z[0, 2], Z[0, 3]
    for e in range(26):
        own[e, 0] = T.bushing[e, u]
    for e in range(15):
        own[e, 0] = T.bushing[e, u] + 1j * TINY
        spatial_bushing(own, 0, r, v, z, False, f, Z[1], Z[1], fz, gr, out)
        own[e, 0] = T.bushing[e, u]
        bushing[e, u] -= (f[0].imag * y[0] + f[1].imag * y[1] + f[2].imag * y[2]) / TINY
        if state >= 0:
            bushing[e, u] -= m[n + state] * out[0].imag / TINY


@njit(**INNER)
def to_link(R, p, x, out):
    """A twist about the origin in the axes and about the origin of a link at p."""
    a = x[3] + x[1] * p[2] - x[2] * p[1]
    b = x[4] + x[2] * p[0] - x[0] * p[2]
    c = x[5] + x[0] * p[1] - x[1] * p[0]
    out[0] = R[0] * x[0] + R[3] * x[1] + R[6] * x[2]
    out[1] = R[1] * x[0] + R[4] * x[1] + R[7] * x[2]
    out[2] = R[2] * x[0] + R[5] * x[1] + R[8] * x[2]
    out[3] = R[0] * a + R[3] * b + R[6] * c
    out[4] = R[1] * a + R[4] * b + R[7] * c
    out[5] = R[2] * a + R[5] * b + R[8] * c


@njit(**INNER)
def inertia_slopes(W, l, virtual, six, inertia):
    """inertia (10, L) += V . (I a + v x* I v) by m, m c and the inertia about the link's origin, link
    axes."""
    x, a, v = six[0], six[1], six[2]
    to_link(W.turn[l], W.place[l], virtual, x)
    to_link(W.turn[l], W.place[l], W.push[l], a)
    to_link(W.turn[l], W.place[l], W.twist[l], v)
    # linear acceleration of the link's origin: the spatial one plus w x u
    a3 = a[3] + v[1] * v[5] - v[2] * v[4]
    a4 = a[4] + v[2] * v[3] - v[0] * v[5]
    a5 = a[5] + v[0] * v[4] - v[1] * v[3]
    inertia[0, l] += x[3] * a3 + x[4] * a4 + x[5] * a5
    # force w' x h + w x (w x h), moment h x a: coefficients of h
    p0 = x[4] * a[2] - x[5] * a[1] + a4 * x[2] - a5 * x[1]
    p1 = x[5] * a[0] - x[3] * a[2] + a5 * x[0] - a3 * x[2]
    p2 = x[3] * a[1] - x[4] * a[0] + a3 * x[1] - a4 * x[0]
    w0, w1, w2 = v[0], v[1], v[2]
    along = x[3] * w0 + x[4] * w1 + x[5] * w2
    square = w0 * w0 + w1 * w1 + w2 * w2
    inertia[1, l] += p0 + along * w0 - square * x[3]
    inertia[2, l] += p1 + along * w1 - square * x[4]
    inertia[3, l] += p2 + along * w2 - square * x[5]
    # moment I w' + w x I w; x . (w x I w) = (x x w) . I w
    c0, c1, c2 = x[1] * w2 - x[2] * w1, x[2] * w0 - x[0] * w2, x[0] * w1 - x[1] * w0
    inertia[4, l] += x[0] * a[0] + c0 * w0
    inertia[5, l] += x[1] * a[1] + c1 * w1
    inertia[6, l] += x[2] * a[2] + c2 * w2
    inertia[7, l] += x[0] * a[1] + x[1] * a[0] + c0 * w1 + c1 * w0
    inertia[8, l] += x[0] * a[2] + x[2] * a[0] + c0 * w2 + c2 * w0
    inertia[9, l] += x[1] * a[2] + x[2] * a[1] + c1 * w2 + c2 * w1


@njit(**CAREFUL)
def link_histories(T, W, first, q, v, w, turn, place, twist, push):
    """Rotations (nodes, L + 1, 9), places, twists and accelerations of the links' origins at all nodes,
    gravity left out.
    """
    links = T.link.shape[0]
    for node in range(q.shape[0]):
        places(T, W, first + node, q[node])
        columns(T, W)
        twists(T, W, first + node, v[node], w[node])
        for l in range(links + 1):
            p, t, a = W.place[l], W.twist[l], W.push[l]
            for e in range(9):
                turn[node, l, e] = W.turn[l, e]
            for e in range(3):
                place[node, l, e] = p[e] + W.origin[e]
                twist[node, l, e] = t[e]
                push[node, l, e] = a[e]
            u0 = t[3] + t[1] * p[2] - t[2] * p[1]
            u1 = t[4] + t[2] * p[0] - t[0] * p[2]
            u2 = t[5] + t[0] * p[1] - t[1] * p[0]
            twist[node, l, 3] = u0
            twist[node, l, 4] = u1
            twist[node, l, 5] = u2
            push[node, l, 3] = a[3] + T.gravity[0] + a[1] * p[2] - a[2] * p[1] + t[1] * u2 - t[2] * u1
            push[node, l, 4] = a[4] + T.gravity[1] + a[2] * p[0] - a[0] * p[2] + t[2] * u0 - t[0] * u2
            push[node, l, 5] = a[5] + T.gravity[2] + a[0] * p[1] - a[1] * p[0] + t[0] * u1 - t[1] * u0


@njit(**CAREFUL)
def member_states(T, W, nodes, q, v, w, zero, energy):
    """energy (nodes, N) stored at unit density at some nodes; of the last one W.line, W.delta, W.rate and the
    elastic force and its slope, W.f and W.fd.  zero (N,): the rate of an elastic force.
    """
    for a in range(nodes.shape[0]):
        node = nodes[a]
        places(T, W, node, q[node])
        columns(T, W)
        twists(T, W, node, v[node], w[node])
        measure_members(T, W, node)
        for g in range(T.segment.shape[0]):
            code, first, last = T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
            unit_forces(T, W, code, first, last, zero, T.times[node])
            if not elastic(code):
                for i in range(first, last):
                    W.f[i] = 0.0
                    W.fd[i] = 0.0
            if code == SPRING:
                spring_energies(T.law, first, last, W.delta, T.times[node], energy[a])
            else:
                other_energies(T, W, code, first, last, T.times[node], energy[a])


@njit(**CAREFUL)
def momenta(T, W, first, q, v, w, out):
    """out (nodes, 7): angular momentum about the global origin, linear momentum, kinetic energy."""
    h = W.some[0]
    for node in range(q.shape[0]):
        places(T, W, first + node, q[node])
        columns(T, W)
        twists(T, W, first + node, v[node], w[node])
        link_wrenches(T, W)
        for l in range(T.link.shape[0]):
            inertia_times(W.body[l], W.twist[l], h)
            for e in range(6):
                out[node, e] += h[e]
                out[node, 6] += 0.5 * h[e] * W.twist[l, e]
        o, p = W.origin, out[node]
        p[0] += o[1] * p[5] - o[2] * p[4]
        p[1] += o[2] * p[3] - o[0] * p[5]
        p[2] += o[0] * p[4] - o[1] * p[3]


@njit(**CAREFUL)
def work_along(T, W, R, last, mu, q, v, w, out):
    """Along a direction of all numbers, the tables T + i tiny dT: points, frames, laws, roads, motions.

    out (1,) += the sum of mu . dr over the nodes 0..last; scratch q (nq,), v, w (n,) complex.
    """
    n, full = T.column.shape[0], v.shape[0]
    for node in range(last + 1):
        for i in range(q.shape[0]):
            q[i] = R.position[node, i]
        for i in range(full):
            v[i] = R.velocity[node, i]
            w[i] = R.rate[node, i]
        places(T, W, node, q)
        columns(T, W)
        twists(T, W, node, v, w)
        link_wrenches(T, W)
        joint_forces(T, W)
        pair_forces(T, W, node, v[n:], w, node < 0)
        coordinate_forces(T, W, node, q, v, node < 0)
        for i in range(full):
            out[0] += mu[node, i] * W.force[i].imag / TINY
