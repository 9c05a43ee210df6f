"""The mathematics of the dual representation once more, slowly and on its own, for what the designs may expect.

Written from the paper's formulas and the requirements (A4 - A19), not from the server's code, so that a script's
expectation is a second opinion. What is left out on purpose: A18's smoothing of drawn curves, which moves them by
less than the hand trembles. Metres; vectors are tuples of three. Python 3 standard library only.
"""

import math


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a, s):
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a):
    return math.sqrt(dot(a, a))


def unit(a):
    return scale(a, 1 / norm(a))


def mirrored_x(p):
    """The image in the plane x = 0."""
    return (-p[0], p[1], p[2])


def principal_axes(points):
    """Centroid and unit axes by falling variance (A5): cyclic Jacobi rotations of the 3 x 3 covariance."""
    n = len(points)
    centre = tuple(sum(p[k] for p in points) / n for k in range(3))
    rows = [sub(p, centre) for p in points]
    a = [[sum(r[i] * r[j] for r in rows) / n for j in range(3)] for i in range(3)]
    v = [[float(i == j) for j in range(3)] for i in range(3)]
    for _ in range(60):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if abs(a[p][q]) < 1e-300:
                continue
            theta = (a[q][q] - a[p][p]) / (2 * a[p][q])
            t = math.copysign(1.0, theta) / (abs(theta) + math.hypot(theta, 1.0))
            c = 1 / math.hypot(t, 1.0)
            s = t * c
            for k in range(3):
                a[k][p], a[k][q] = c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]
            for k in range(3):
                a[p][k], a[q][k] = c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]
            for k in range(3):
                v[k][p], v[k][q] = c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]
    order = sorted(range(3), key=lambda k: -a[k][k])
    x, y = (tuple(v[k][axis] for k in range(3)) for axis in order[:2])
    return centre, x, y, cross(x, y)


def exponents(degree):
    return [(i, d - i) for d in range(degree + 1) for i in range(d, -1, -1)]


def solve(a, b):
    """Gaussian elimination with row pivots."""
    n = len(b)
    a = [row[:] + [b[i]] for i, row in enumerate(a)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(a[i][k]))
        a[k], a[pivot] = a[pivot], a[k]
        for i in range(k + 1, n):
            f = a[i][k] / a[k][k]
            for j in range(k, n + 1):
                a[i][j] -= f * a[k][j]
    x = [0.0] * n
    for k in range(n - 1, -1, -1):
        x[k] = (a[k][n] - sum(a[k][j] * x[j] for j in range(k + 1, n))) / a[k][k]
    return x


class Surface:
    """A weighted least-squares surface of total degree N over a base plane (A4 - A6), by normal equations in a
    centred, scaled box: enough digits for degrees up to 4. `points` are [position, pressure] pairs."""

    def __init__(self, points, degree, frame=None, extra=()):
        self.degree = degree
        self.frame = frame or principal_axes([p for p, _ in points])
        rows = [(self.local(p), w) for p, w in points]
        xs, ys = [r[0][0] for r in rows], [r[0][1] for r in rows]
        self.box = (min(xs), max(xs), min(ys), max(ys))
        rows += [(self.local(p), w) for p, w in extra]
        terms = exponents(degree)
        n = len(terms)
        a = [[0.0] * n for _ in range(n)]
        b = [0.0] * n
        for (x, y, z), w in rows:
            phi = self.basis(x, y)
            for i in range(n):
                b[i] += w * phi[i] * z
                for j in range(i, n):
                    a[i][j] += w * phi[i] * phi[j]
        for i in range(n):
            for j in range(i):
                a[i][j] = a[j][i]
        self.coefficients = solve(a, b)

    def local(self, p):
        o, x, y, z = self.frame
        d = sub(p, o)
        return (dot(d, x), dot(d, y), dot(d, z))

    def world(self, x, y, z):
        o, ex, ey, ez = self.frame
        return add(o, add(scale(ex, x), add(scale(ey, y), scale(ez, z))))

    def basis(self, x, y):
        x0, x1, y0, y1 = self.box
        u, v = (2 * x - x0 - x1) / (x1 - x0), (2 * y - y0 - y1) / (y1 - y0)
        return [u**i * v**j for i, j in exponents(self.degree)]

    def height(self, x, y):
        return sum(c * phi for c, phi in zip(self.coefficients, self.basis(x, y)))

    def residual(self, p):
        """Signed distance of a point along the base plane's normal (A8)."""
        x, y, z = self.local(p)
        return z - self.height(x, y)

    def weighted_rms(self, points):
        return math.sqrt(sum(w * self.residual(p) ** 2 for p, w in points) / sum(w for _, w in points))

    def hit(self, origin, direction, reach):
        """The first place where the ray meets the surface within `reach` metres, by steps and bisection."""
        direction = unit(direction)

        def side(t):
            return self.residual(add(origin, scale(direction, t)))

        steps = 400
        before = side(0.0)
        for k in range(1, steps + 1):
            now = side(reach * k / steps)
            if (before < 0) != (now < 0):
                low, high = reach * (k - 1) / steps, reach * k / steps
                for _ in range(60):
                    middle = (low + high) / 2
                    if (side(middle) < 0) == (before < 0):
                        low = middle
                    else:
                        high = middle
                return add(origin, scale(direction, low))
            before = now
        raise ValueError("the ray misses")


def along(curve, count):
    """`count` points evenly spaced along a polyline, its ends among them."""
    lengths = [0.0]
    for a, b in zip(curve, curve[1:]):
        lengths.append(lengths[-1] + norm(sub(b, a)))
    result, k = [], 0
    for i in range(count):
        s = lengths[-1] * i / max(1, count - 1)
        while k + 2 < len(curve) and lengths[k + 1] < s:
            k += 1
        f = (s - lengths[k]) / (lengths[k + 1] - lengths[k])
        result.append(add(curve[k], scale(sub(curve[k + 1], curve[k]), min(1.0, max(0.0, f)))))
    return result


def draw_profile(points, surface, curves, mirror=False):
    """A19 with A8: the surface that follows `curves`, and the points with their residuals carried along. As many
    temporary points as the shape has, of pressure 1, shared out by length. `mirror`: half of them are images."""
    total = (len(points) + 1) // 2 if mirror else len(points)
    lengths = [sum(norm(sub(b, a)) for a, b in zip(c, c[1:])) for c in curves]
    drawn = []
    for curve, length in zip(curves, lengths):
        drawn += along(curve, max(2, round(total * length / sum(lengths))))
    if mirror:
        drawn += [mirrored_x(p) for p in drawn]
    after = Surface(points, surface.degree, surface.frame, [(p, 1.0) for p in drawn])
    normal = surface.frame[3]
    moved = []
    for p, w in points:
        x, y, _ = surface.local(p)
        moved.append((add(p, scale(normal, after.height(x, y) - surface.height(x, y))), w))
    return after, moved


def falloff(x):
    """A15, eq. 4."""
    beta = math.exp(-2.0)
    return 0.0 if x >= 1 else (math.exp(-2.0 * x * x) - beta) / (1 - beta)


def push(points, start, normal, depth, radius, reach):
    """A14 - A17 for a disk that moves straight along its normal: what it meets goes with it, what is near follows by
    the smooth mean  sum eta^2 v / sum eta . `reach` is the fraction of the largest distance (A16)."""
    normal = unit(normal)
    contact = {}
    for i, (p, _) in enumerate(points):
        d = sub(p, start)
        ahead = dot(d, normal)
        aside = norm(sub(d, scale(normal, ahead)))
        if 0 <= ahead < depth and aside <= radius:
            contact[i] = depth - ahead
    rest = [p for p, _ in points]
    others = [j for j in range(len(points)) if j not in contact]
    far = max((norm(sub(rest[i], rest[j])) for i in contact for j in others), default=0.0)
    moved = []
    for j, (p, w) in enumerate(points):
        by = contact.get(j, 0.0)
        if reach * far > 0:
            etas = [(falloff(norm(sub(rest[i], p)) / (reach * far)), v) for i, v in contact.items() if i != j]
            total = sum(eta for eta, _ in etas)
            if total > 0:  # A contact goes with the others only where they go farther than it is pushed itself.
                by = max(by, sum(eta * eta * v for eta, v in etas) / total)
        moved.append((add(p, scale(normal, by)), w))
    return moved, len(contact)
