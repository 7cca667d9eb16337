# mypy: ignore-errors
"""Places, twists and accelerations of the links of a tree, and the forces that the motion asks for, compiled.

Recursive Newton-Euler in global axes about one origin (Featherstone 2008, *Rigid Body Dynamics Algorithms*,
chapters 2 and 5). For link i with parent p, columns S of its joint and inertia I:

    v_i = v_p + S qd,   a_i = a_p + S qdd + v_p x S qd,   f_i = I a_i + v_i x* I v_i,   a_ground = -g
"""

from numba import njit
from numpy import cos, sin

from ...compiler.held import only_with
from ...compiler.options import CALLED, INNER
from .rotations import turn

DRIVEN, REVOLUTE, TRANSLATION, SPHERICAL = 0, 1, 2, 3


@njit(**CALLED)
def moved(T, q, d, out):
    """out = q exp(d)."""
    for l in range(T.link.shape[0]):
        kind, first, count, at = T.link[l, 0], T.link[l, 2], T.link[l, 3], T.link[l, 4]
        if kind == SPHERICAL:
            turn(q, at, d, first, out)
        else:
            for k in range(count):
                out[at + k] = q[at + k] + d[first + k]


@njit(**INNER)
def joint_rotation(T, l, q, o, small):
    """small[0] = rotation of link l against its joint frame; False where the joint does not turn."""
    kind, at = T.link[l, 0], T.link[l, 4]
    if kind == REVOLUTE:
        x, y, z = T.axes[l, 0], T.axes[l, 1], T.axes[l, 2]
        s, c = sin(q[at]), cos(q[at])
        d = 1.0 - c
        o[0, 0] = c + d * x * x
        o[0, 1] = d * x * y - s * z
        o[0, 2] = d * x * z + s * y
        o[1, 0] = d * x * y + s * z
        o[1, 1] = c + d * y * y
        o[1, 2] = d * y * z - s * x
        o[2, 0] = d * x * z - s * y
        o[2, 1] = d * y * z + s * x
        o[2, 2] = c + d * z * z
        return True
    if kind == SPHERICAL:
        w, x, y, z = q[at], q[at + 1], q[at + 2], q[at + 3]
        # 2/|q|^2: a rotation whatever rounding did to the norm
        d = 2.0 / (w * w + x * x + y * y + z * z)
        o[0, 0] = 1.0 - d * (y * y + z * z)
        o[0, 1] = d * (x * y - w * z)
        o[0, 2] = d * (x * z + w * y)
        o[1, 0] = d * (x * y + w * z)
        o[1, 1] = 1.0 - d * (x * x + z * z)
        o[1, 2] = d * (y * z - w * x)
        o[2, 0] = d * (x * z - w * y)
        o[2, 1] = d * (y * z + w * x)
        o[2, 2] = 1.0 - d * (x * x + y * y)
        return True
    return False


@njit(**INNER)
def places(T, W, step, q):
    """Rotation and place of every link, places less the origin."""
    links = T.link.shape[0]
    joint = W.small[0]
    for e in range(3):
        W.place[links, e] = 0.0
    for l in range(links):
        parent, at, kind = T.link[l, 1], T.link[l, 4], T.link[l, 0]
        base, out = W.turn[parent], W.turn[l]
        frame = W.small[1]
        for i in range(3):
            for j in range(3):
                frame[i, j] = (
                    base[3 * i] * T.place[l, 3 + j]
                    + base[3 * i + 1] * T.place[l, 6 + j]
                    + base[3 * i + 2] * T.place[l, 9 + j]
                )
        for i in range(3):
            W.place[l, i] = (
                W.place[parent, i] + base[3 * i] * T.place[l, 0] + base[3 * i + 1] * T.place[l, 1]
                + base[3 * i + 2] * T.place[l, 2]
            )  # fmt: skip
        turns = joint_rotation(T, l, q, joint, W.small)
        if kind == TRANSLATION:
            for k in range(T.link[l, 3]):
                for i in range(3):
                    W.place[l, i] += q[at + k] * (
                        frame[i, 0] * T.axes[l, 3 * k]
                        + frame[i, 1] * T.axes[l, 3 * k + 1]
                        + frame[i, 2] * T.axes[l, 3 * k + 2]
                    )
        elif kind == DRIVEN:
            d = T.link[l, 5]
            turns = True
            for i in range(3):
                for j in range(3):
                    joint[i, j] = T.motion[step, d, 3 * i + j]
                    W.place[l, i] += frame[i, j] * T.motion[step, d, 9 + j]
        for i in range(3):
            for j in range(3):
                if turns:
                    out[3 * i + j] = (
                        frame[i, 0] * joint[0, j] + frame[i, 1] * joint[1, j] + frame[i, 2] * joint[2, j]
                    )
                else:
                    out[3 * i + j] = frame[i, j]
    c = T.centre_link[0]
    for e in range(3):
        W.origin[e] = W.place[c, e] if c >= 0 else 0.0 * W.place[links, e]
    for l in range(links + 1):
        for e in range(3):
            W.place[l, e] -= W.origin[e]


@njit(**INNER)
def columns(T, W):
    """The columns of all joints: a turning axis through the link's origin, or a direction."""
    base = W.small[1]
    for l in range(T.link.shape[0]):
        kind, first, count = T.link[l, 0], T.link[l, 2], T.link[l, 3]
        own = W.turn[l]
        if kind == TRANSLATION:  # axes of the joint frame; the link itself does not turn against it
            for k in range(count):
                for i in range(3):
                    W.s[first + k, i] = 0.0
                    W.s[first + k, 3 + i] = (
                        own[3 * i] * T.axes[l, 3 * k] + own[3 * i + 1] * T.axes[l, 3 * k + 1]
                        + own[3 * i + 2] * T.axes[l, 3 * k + 2]
                    )  # fmt: skip
        elif kind != DRIVEN:
            x, y, z = W.place[l, 0], W.place[l, 1], W.place[l, 2]
            for k in range(count):
                for i in range(3):
                    base[0, i] = (
                        own[3 * i] * T.axes[l, 3 * k] + own[3 * i + 1] * T.axes[l, 3 * k + 1]
                        + own[3 * i + 2] * T.axes[l, 3 * k + 2]
                    )  # fmt: skip
                a, b, c = base[0, 0], base[0, 1], base[0, 2]
                s = W.s[first + k]
                s[0] = a
                s[1] = b
                s[2] = c
                s[3] = y * c - z * b
                s[4] = z * a - x * c
                s[5] = x * b - y * a


@njit(**INNER)
def cross_motion(a, b, out):
    """out = a x b of two twists."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    out[3] = a[1] * b[5] - a[2] * b[4] + a[4] * b[2] - a[5] * b[1]
    out[4] = a[2] * b[3] - a[0] * b[5] + a[5] * b[0] - a[3] * b[2]
    out[5] = a[0] * b[4] - a[1] * b[3] + a[3] * b[1] - a[4] * b[0]


@njit(**INNER)
def cross_force(a, f, out):
    """out = a x* f of a twist and a wrench."""
    out[0] = a[1] * f[2] - a[2] * f[1] + a[4] * f[5] - a[5] * f[4]
    out[1] = a[2] * f[0] - a[0] * f[2] + a[5] * f[3] - a[3] * f[5]
    out[2] = a[0] * f[1] - a[1] * f[0] + a[3] * f[4] - a[4] * f[3]
    out[3] = a[1] * f[5] - a[2] * f[4]
    out[4] = a[2] * f[3] - a[0] * f[5]
    out[5] = a[0] * f[4] - a[1] * f[3]


@njit(**INNER)
def dot6(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@njit(**INNER)
def inertia_times(J, a, out):
    """out = inertia J (m, h, xx, yy, zz, xy, xz, yz) times a twist."""
    m, x, y, z = J[0], J[1], J[2], J[3]
    out[0] = J[4] * a[0] + J[7] * a[1] + J[8] * a[2] + y * a[5] - z * a[4]
    out[1] = J[7] * a[0] + J[5] * a[1] + J[9] * a[2] + z * a[3] - x * a[5]
    out[2] = J[8] * a[0] + J[9] * a[1] + J[6] * a[2] + x * a[4] - y * a[3]
    out[3] = m * a[3] - y * a[2] + z * a[1]
    out[4] = m * a[4] - z * a[0] + x * a[2]
    out[5] = m * a[5] - x * a[1] + y * a[0]


@njit(**INNER)
def global_inertia(J, R, p, out):
    """out = inertia J of link axes and origin, in global axes about the origin of spatial vectors."""
    m = J[0]
    hx = R[0] * J[1] + R[1] * J[2] + R[2] * J[3]
    hy = R[3] * J[1] + R[4] * J[2] + R[5] * J[3]
    hz = R[6] * J[1] + R[7] * J[2] + R[8] * J[3]
    # R I R^T by rows of R I
    a0 = R[0] * J[4] + R[1] * J[7] + R[2] * J[8]
    a1 = R[0] * J[7] + R[1] * J[5] + R[2] * J[9]
    a2 = R[0] * J[8] + R[1] * J[9] + R[2] * J[6]
    b0 = R[3] * J[4] + R[4] * J[7] + R[5] * J[8]
    b1 = R[3] * J[7] + R[4] * J[5] + R[5] * J[9]
    b2 = R[3] * J[8] + R[4] * J[9] + R[5] * J[6]
    c0 = R[6] * J[4] + R[7] * J[7] + R[8] * J[8]
    c1 = R[6] * J[7] + R[7] * J[5] + R[8] * J[9]
    c2 = R[6] * J[8] + R[7] * J[9] + R[8] * J[6]
    x, y, z = p[0], p[1], p[2]
    # about the new origin: I - (h^ p^ + p^ h^) - m p^ p^, h at the link's origin
    out[0] = m
    out[1] = hx + m * x
    out[2] = hy + m * y
    out[3] = hz + m * z
    out[4] = a0 * R[0] + a1 * R[1] + a2 * R[2] + 2.0 * (hy * y + hz * z) + m * (y * y + z * z)
    out[5] = b0 * R[3] + b1 * R[4] + b2 * R[5] + 2.0 * (hx * x + hz * z) + m * (x * x + z * z)
    out[6] = c0 * R[6] + c1 * R[7] + c2 * R[8] + 2.0 * (hx * x + hy * y) + m * (x * x + y * y)
    out[7] = a0 * R[3] + a1 * R[4] + a2 * R[5] - hx * y - hy * x - m * x * y
    out[8] = a0 * R[6] + a1 * R[7] + a2 * R[8] - hx * z - hz * x - m * x * z
    out[9] = b0 * R[6] + b1 * R[7] + b2 * R[8] - hy * z - hz * y - m * y * z


@only_with("drive")
def driven_motion(T, W, step, l):
    """Twist and acceleration of a link with a prescribed joint."""
    parent, d = T.link[l, 1], T.link[l, 5]
    base = W.turn[parent]
    out = W.some
    # spin, velocity and their rates from the joint frame to global axes
    for g in range(4):
        for i in range(3):
            total = 0.0 * base[0]
            for j in range(3):
                along = 0.0 * base[0]
                for k in range(3):
                    along += base[3 * i + k] * T.place[l, 3 + 3 * k + j]
                total += along * T.motion[step, d, 12 + 3 * g + j]
            out[0, 3 * g + i] = total
    x, y, z = W.place[l, 0], W.place[l, 1], W.place[l, 2]
    a, own, rate = out[0], out[1], out[2]
    for i in range(3):
        own[i] = a[i]
        rate[i] = a[6 + i]
    # velocity at the origin: v - w x p; its rate in the joint frame: a - w' x p - w x v
    own[3] = a[3] - (a[1] * z - a[2] * y)
    own[4] = a[4] - (a[2] * x - a[0] * z)
    own[5] = a[5] - (a[0] * y - a[1] * x)
    rate[3] = a[9] - (a[7] * z - a[8] * y) - (a[1] * a[5] - a[2] * a[4])
    rate[4] = a[10] - (a[8] * x - a[6] * z) - (a[2] * a[3] - a[0] * a[5])
    rate[5] = a[11] - (a[6] * y - a[7] * x) - (a[0] * a[4] - a[1] * a[3])
    cross_motion(W.twist[parent], own, out[3])
    for e in range(6):
        W.twist[l, e] = W.twist[parent, e] + own[e]
        W.push[l, e] = W.push[parent, e] + rate[e] + out[3, e]


@njit(**INNER)
def twists(T, W, step, v, w):
    """Twists and accelerations of all links."""
    own, extra = W.some[0], W.some[1]
    for l in range(T.link.shape[0]):
        parent, first, count = T.link[l, 1], T.link[l, 2], T.link[l, 3]
        if T.link[l, 0] == DRIVEN:
            driven_motion(T, W, step, l)
            continue
        for e in range(6):
            own[e] = 0.0
            W.push[l, e] = W.push[parent, e]
        for k in range(first, first + count):
            for e in range(6):
                own[e] += W.s[k, e] * v[k]
                W.push[l, e] += W.s[k, e] * w[k]
        cross_motion(W.twist[parent], own, extra)
        for e in range(6):
            W.twist[l, e] = W.twist[parent, e] + own[e]
            W.push[l, e] += extra[e]


@njit(**INNER)
def link_wrenches(T, W):
    """I a + v x* I v of every link, and its inertia in global axes."""
    one, two, three = W.some[0], W.some[1], W.some[2]
    for l in range(T.link.shape[0]):
        if T.inertia[l, 0].real == 0.0 and T.inertia[l, 4].real == 0.0 and T.inertia[l, 5].real == 0.0:
            for e in range(6):
                W.wrench[l, e] = 0.0
            for e in range(10):
                W.body[l, e] = 0.0
            continue
        global_inertia(T.inertia[l], W.turn[l], W.place[l], W.body[l])
        inertia_times(W.body[l], W.push[l], one)
        inertia_times(W.body[l], W.twist[l], two)
        cross_force(W.twist[l], two, three)
        for e in range(6):
            W.wrench[l, e] = one[e] + three[e]


@njit(**INNER)
def joint_forces(T, W):
    """Wrenches of the subtrees, and their components along the columns: W.force."""
    links = T.link.shape[0]
    for l in range(links - 1, -1, -1):
        for k in range(T.link[l, 2], T.link[l, 2] + T.link[l, 3]):
            W.force[k] = dot6(W.s[k], W.wrench[l])
        parent = T.link[l, 1]
        if parent < links:
            for e in range(6):
                W.wrench[parent, e] += W.wrench[l, e]
