"""Grasp mapping by scipy's differential evolution: the problem that main.rs hands over on standard input, written again with numpy.

Everything is worked out for many poses of the palm at once, since scipy evaluates a population in one call (`vectorized`): the fastest way it offers.
Kinematics, Jacobians, measure, penalties and clearance follow crates/robot/src/kinematics/closed_form.rs and crates/robot/src/grasp/cost.rs,
from the links of the robot alone.
Prints the cost of the poses that are to be compared, and what each run found, as JSON."""
import json
import sys
import time

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import differential_evolution, minimize
from scipy.spatial.transform import Rotation

REACHED, SMALLEST, PER_METRE = 1e-6, 1e-3, 400.0
MARGIN, OVERLAP, UNCROSSED = 0.0008, 0.002, 0.004
APART, PALM_APART = 0.012, 0.03
LIFTED = (0.2, 0.45)
IDLE = ((0.12, 0.05), (0.45, 0.4), (0.85, 0.9))
SCANNED, REFINED, INSIDE, ALIKE = 7, 4, 0.02, 1e-9
BESIDE = 0.02 / 2.0 ** np.arange(5)
REACH = 0.25
LEAST_ALIGNMENT = 0.1
STARTS = 6


def turned(quaternion):
    w, x, y, z = quaternion
    return Rotation.from_quat([x, y, z, w]).as_matrix()


def along(axis, angles):
    """Rotations about one axis, n x 3 x 3."""
    return Rotation.from_rotvec(np.outer(angles, axis)).as_matrix()


class Finger:
    """A chain of four joints from the palm to the tip, the last one coupled to the third or free."""

    def __init__(self, hand, finger):
        self.name, self.radius = finger["name"], finger["radius"]
        path, link = [], finger["link"]
        while link != hand["palm"]:
            path.insert(0, link)
            link = hand["links"][link]["parent"]
        # Of each joint: place and turn against the one before, axis, degree of freedom, and the bars that hang at it.
        self.joints, self.bars, self.dofs = [], [], []
        place, turn = np.zeros(3), np.eye(3)
        for link in (hand["links"][index] for index in path):
            place, turn = place + turn @ np.array(link["at"]), turn @ turned(link["turned"])
            if link["joint"]:
                joint = link["joint"]
                if joint["dof"] not in self.dofs:
                    self.dofs.append(joint["dof"])
                self.joints.append((place, turn, np.array(joint["axis"]), self.dofs.index(joint["dof"]), joint["ratio"]))
                place, turn = np.zeros(3), np.eye(3)
            for start, end, radius in link["capsules"]:
                ends = [place + turn @ np.array(point) for point in (start, end)]
                parts = max(int(np.ceil(np.linalg.norm(ends[1] - ends[0]) / APART)), 1)
                shares = np.linspace(0, 1, parts + 1)[:, None]
                balls = ends[0] + (ends[1] - ends[0]) * shares
                self.bars.append((len(self.joints) - 1, balls, radius))
        self.tip, self.pad = place + turn @ np.array(finger["tip"]), turn @ np.array(finger["pad"])
        self.ranges = np.array([hand["ranges"][dof] for dof in self.dofs])
        self.coupled = len(self.dofs) == 3
        # The frame in which the inverse has a closed form: x along the straight finger, z where it bends to.
        origins, axes, _, _, tip, _ = self.forward(np.zeros((1, len(self.dofs))))
        o, a, tip = [it[0] for it in origins], [it[0] for it in axes], tip[0]
        self.links = [np.linalg.norm(o[2] - o[1]), np.linalg.norm(o[3] - o[2]), np.linalg.norm(tip - o[3])]
        self.length = sum(self.links)
        x = (o[2] - o[1]) / self.links[0]
        z = np.cross(a[1], x)
        self.base, self.frame = o[1], np.stack([x, np.cross(z, x), z], axis=1)
        self.sign = np.sign(a[0] @ z)

    def forward(self, angles):
        """Origins and axes of the joints, their turns, centres of all balls, tip and pad; palm frame."""
        n = len(angles)
        at, turn = np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3))
        origins, axes, turns = [], [], []
        for place, fixed, axis, dof, ratio in self.joints:
            at = at + turn @ place
            turn = turn @ fixed @ along(axis, angles[:, dof] * ratio)
            origins.append(at)
            axes.append(turn @ axis)
            turns.append(turn)
        balls = [(origins[joint][:, None] + centres @ turns[joint].transpose(0, 2, 1), radius)
                 for joint, centres, radius in self.bars]
        return origins, axes, turns, balls, at + turn @ self.tip, turn @ self.pad

    def measure(self, angles):
        """Manipulability from the Jacobian, over the cube of the length, times the freedom of the joints."""
        origins, axes, _, _, tip, _ = self.forward(angles)
        jacobian = np.zeros((len(angles), 3, len(self.dofs)))
        for (_, _, _, dof, ratio), origin, axis in zip(self.joints, origins, axes):
            jacobian[:, :, dof] += ratio * np.cross(axis, tip - origin)
        square = np.linalg.det(jacobian @ jacobian.transpose(0, 2, 1))
        return np.sqrt(np.maximum(square, 0)) / self.length**3 * self.free(angles)

    def free(self, angles):
        low, high = self.ranges.T
        return np.prod(np.clip(4 * (angles - low) * (high - angles) / (high - low) ** 2, 0, 1), axis=1) ** (1 / len(self.dofs))

    def reach(self, points):
        """The best angles by measure that reach points of the palm's frame, or angles that come near: angles, miss."""
        p = (points - self.base) @ self.frame
        across = np.hypot(p[:, 0], p[:, 1])
        best = None
        for phi, r in ((np.arctan2(p[:, 1], p[:, 0]), across), (np.arctan2(-p[:, 1], -p[:, 0]), -across)):
            first = np.clip(self.sign * phi, *self.ranges[0])
            off = phi - self.sign * first
            bend = first, r * np.cos(off), p[:, 2], r * np.sin(off)
            found = self.bend_coupled(bend) if self.coupled else self.scan(bend)
            best = found if best is None else choose(best[1] < REACHED, best, choose(beats(found, best), found, best))
        return best[0], best[1]

    def bend_coupled(self, bend):
        l2, l3, l4 = self.links
        a, b = 4 * l2 * l4, 2 * l3 * (l2 + l4)
        c = l2**2 + l3**2 + l4**2 - 2 * l2 * l4 - bend[1] ** 2 - bend[2] ** 2
        root = (np.sqrt(np.maximum(b * b - 4 * a * c, 0)) - b) / (2 * a)
        third = np.clip(np.arccos(np.clip(root, -1, 1)), *self.ranges[2])
        return self.candidate(bend, third, third)

    def bend_free(self, bend, fourth):
        l2, l3, l4 = self.links
        x, y = l3 + l4 * np.cos(fourth), l4 * np.sin(fourth)
        bar = np.hypot(x, y)
        cosine = np.clip((bend[1] ** 2 + bend[2] ** 2 - l2**2 - bar**2) / (2 * l2 * bar), -1, 1)
        third = np.arccos(cosine) - np.arctan2(y, x)
        third = np.clip((third + np.pi) % (2 * np.pi) - np.pi, *self.ranges[2])
        return self.candidate(bend, third, fourth)

    def scan(self, bend):
        """The free last joint: tried over its range, then where a parabola through the best three has its top."""
        tried = np.linspace(*self.ranges[3], SCANNED)
        n = len(bend[0])
        found = [self.bend_free(bend, np.full(n, fourth)) for fourth in tried]
        top, best = np.zeros(n, int), found[0]
        for index in range(1, SCANNED):
            better = beats(found[index], best)
            top, best = np.where(better, index, top), choose(better, found[index], best)
        pick = lambda at: (tried[at], tuple(np.stack([it[part] for it in found])[at, np.arange(n)] for part in range(3)))
        low, best, high = pick(np.maximum(top - 1, 0)), pick(top), pick(np.minimum(top + 1, SCANNED - 1))
        done = np.zeros(n, bool)
        for _ in range(REFINED):
            below, above = best[0] - low[0], high[0] - best[0]
            up, down = high[1][2] - best[1][2], low[1][2] - best[1][2]
            bent = below * up + above * down
            reached = (low[1][1] < REACHED) & (best[1][1] < REACHED) & (high[1][1] < REACHED)
            curved = reached & (below > 0) & (above > 0) & (bent < 0)
            edge = INSIDE * (high[0] - low[0])
            with np.errstate(divide="ignore", invalid="ignore"):
                vertex = best[0] - 0.5 * (below**2 * up - above**2 * down) / bent
            vertex = np.clip(np.where(curved, vertex, best[0]), low[0] + edge, high[0] - edge)
            done |= curved & (np.abs(vertex - best[0]) < 1e-9)
            halved = np.where(above > below - 1e-9, best[0] + above / 2, best[0] - below / 2)
            fourth = np.where(curved, vertex, halved)
            new = fourth, self.bend_free(bend, fourth)
            right, better = fourth > best[0], beats(new[1], best[1])
            replace = lambda mask, one, other: (np.where(mask, one[0], other[0]), choose(mask, one[1], other[1]))
            low, best, high = (
                replace(~done & right & better, best, replace(~done & ~right & ~better, new, low)),
                replace(~done & better, new, best),
                replace(~done & ~right & better, best, replace(~done & right & ~better, new, high)),
            )
        return self.top(bend, best[1])

    def top(self, bend, best):
        """The top of a parabola through the measures at the best angle of the free last joint and beside it."""
        low, high = self.ranges[3]
        fourth = best[0][:, 3]
        found, left = best, best[1] < REACHED
        for beside in BESIDE:
            below, above = (self.bend_free(bend, fourth + by) for by in (-beside, beside))
            inside = (low < fourth - beside) & (fourth + beside < high) & (below[1] < REACHED) & (above[1] < REACHED)
            bent = below[2] + above[2] - 2 * best[2]
            with np.errstate(divide="ignore", invalid="ignore"):
                shift = 0.5 * beside * (below[2] - above[2]) / bent
            curved = (bent < 0) & (np.abs(shift) < beside)
            top = self.bend_free(bend, fourth + np.where(curved, shift, 0))
            found = choose(left & inside & curved & (top[1] < REACHED), top, found)
            left &= ~inside
        return found

    def candidate(self, bend, third, fourth):
        l2, l3, l4 = self.links
        first, r, z, beside = bend
        tip_r = l2 + l3 * np.cos(third) + l4 * np.cos(third + fourth)
        tip_z = l3 * np.sin(third) + l4 * np.sin(third + fourth)
        second = np.clip(np.arctan2(z * tip_r - r * tip_z, r * tip_r + z * tip_z), *self.ranges[1])
        at_r = np.cos(second) * tip_r - np.sin(second) * tip_z
        at_z = np.sin(second) * tip_r + np.cos(second) * tip_z
        miss = np.sqrt((r - at_r) ** 2 + (z - at_z) ** 2 + beside**2)
        angles = np.stack([first, second, third] + ([] if self.coupled else [fourth]), axis=1)
        if self.coupled:
            return angles, miss, np.zeros(len(first))
        # Only what is compared along the way of a free joint needs a measure here, by the minors of the planar Jacobian; `measure` has the whole one.
        by_23, by_34 = l2 * tip_z, l3 * l4 * np.sin(fourth)
        by_24 = l2 * l4 * np.sin(third + fourth) + by_34
        return angles, miss, np.abs(at_r) * np.sqrt(by_23**2 + by_24**2 + by_34**2) / self.length**3 * self.free(angles)


def choose(mask, one, other):
    return tuple(np.where(mask.reshape((-1,) + (1,) * (a.ndim - 1)), a, b) for a, b in zip(one, other))


def beats(one, other):
    here, there = one[1] < REACHED, other[1] < REACHED
    return np.where(here & there, one[2] > other[2], np.where(here != there, here, one[1] < other[1] - ALIKE))


def price(over):
    over = np.maximum(over, 0) / OVERLAP
    return np.where(over < 1, over * over, 2 * over - 1)


class Problem:
    """What poses of the palm cost for one grasp."""

    def __init__(self, hand, problem):
        self.fingers = [Finger(hand, finger) for finger in hand["fingers"]]
        names = [finger.name for finger in self.fingers]
        self.contacts = [(names.index(it["finger"]), np.array(it["point"]), np.array(it["normal"])) for it in problem["contacts"]]
        self.tips = [point + normal * self.fingers[index].radius for index, point, normal in self.contacts]
        self.middle = np.mean(self.tips, axis=0)
        self.idle = [index for index in range(len(names)) if index not in [it[0] for it in self.contacts]]
        self.parts = [(np.array(it["at"]), turned(it["turned"]), it["kind"], np.array(it["size"])) for it in problem["parts"]]
        self.boxes = [(np.array(box["at"]), turned(box["turned"]), np.array(box["half"])) for box in hand["palm_boxes"]]
        self.palm = np.concatenate([at + shell(half) @ turn.T for at, turn, half in self.boxes])
        self.cos_pad = np.cos(problem["largest_pad_angle"])
        self.friction = problem["friction"]
        self.evaluations = 0

    def pose(self, x):
        """Palm poses of n x 6 coordinates: a shift from the middle of the contacts, and a turn as a vector."""
        return self.middle + x[:, :3], Rotation.from_rotvec(x[:, 3:]).as_matrix()

    def distance(self, at, turn, points):
        """Signed distances of n x b points of the palm's frame to each part."""
        world = points @ turn.transpose(0, 2, 1) + at[:, None]
        for place, frame, kind, size in self.parts:
            p = (world - place) @ frame
            if kind == "ball":
                yield np.linalg.norm(p, axis=2) - size[0]
                continue
            over = np.abs(p) - size / 2 if kind == "box" else np.stack(
                [np.hypot(p[..., 0], p[..., 1]) - size[0], np.abs(p[..., 2]) - size[1] / 2], axis=2)
            inside = over.max(axis=2)
            yield np.where(inside <= 0, inside, np.linalg.norm(np.maximum(over, 0), axis=2))

    def overlap(self, at, turn, balls):
        return sum(price(radius + MARGIN - distance).sum(axis=1)
                   for centres, radius in balls for distance in self.distance(at, turn, centres))

    def held(self, at, turn):
        """The touching fingers: index, angles, miss, target, and the way into the surface."""
        for (index, _, normal), tip in zip(self.contacts, self.tips):
            target = np.einsum("nji,nj->ni", turn, tip - at)
            yield index, *self.fingers[index].reach(target), target, -np.einsum("nji,j->ni", turn, normal)

    def friction_margin(self):
        """The share by which friction may be smaller until the contacts do not hold: least ratio of tangential to normal force of forces in balance."""
        normals = np.array([normal for *_, normal in self.contacts])
        arms = np.array([point for _, point, _ in self.contacts])
        arms = (arms - arms.mean(axis=0)) / np.linalg.norm(arms - arms.mean(axis=0), axis=1).mean()
        wrenches = np.vstack([np.hstack([np.vstack([np.eye(3), np.cross(arm, np.eye(3)).T]) for arm in arms]), -normals.reshape(1, -1)])
        wanted = np.array([0.0] * 6 + [1.0])
        some, free = np.linalg.pinv(wrenches) @ wanted, null_space(wrenches)

        def room(x):
            forces = (some + free @ x[:-1]).reshape(-1, 3)
            pressed = -(forces * normals).sum(axis=1)
            along = forces + normals * pressed[:, None]
            return np.concatenate([x[-1] * pressed - np.sqrt((along**2).sum(axis=1) + 1e-12), pressed])

        generator = np.random.default_rng(0)
        starts = [np.append(generator.normal(size=free.shape[1]) * 0.3, 2.0) for _ in range(STARTS)]
        found = [minimize(lambda x: x[-1], start, constraints={"type": "ineq", "fun": room}, method="SLSQP", options={"maxiter": 500})
                 for start in starts]
        needed = min((it.x[-1] for it in found if it.success and room(it.x).min() > -1e-6), default=np.inf)
        return max(1 - needed / self.friction, 0.0)

    def alignment(self, pad, into):
        return np.maximum((pad * into).sum(axis=1), LEAST_ALIGNMENT)

    def measure(self, x):
        at, turn = self.pose(x)
        each = []
        for index, angles, miss, _, into in self.held(at, turn):
            finger = self.fingers[index]
            measure = finger.measure(angles) * self.alignment(finger.forward(angles)[5], into)
            each.append(np.where(miss < REACHED, measure, 0))
        return np.prod(each, axis=0) ** (1 / len(each))

    def cost(self, x):
        self.evaluations += len(x)
        at, turn = self.pose(x)
        n = len(x)
        cost, strings, touching, before = np.zeros(n), {}, {}, None
        for index, angles, miss, target, into in self.held(at, turn):
            finger = self.fingers[index]
            measure = np.where(miss < REACHED, finger.measure(angles), 0)
            cost += (PER_METRE * miss - np.log(np.maximum(measure, SMALLEST))) / len(self.contacts)
            origins, _, _, balls, _, pad = finger.forward(angles)
            beyond = np.maximum(self.cos_pad + 0.01 - (pad * into).sum(axis=1), 0)
            cost += (beyond / 0.1) ** 2 + self.overlap(at, turn, balls)
            cost -= np.log(self.alignment(pad, into)) / len(self.contacts)
            strings[index], touching[index] = balls, angles
            if finger.name != "thumb":
                if before is not None:
                    lateral = (origins[0] - before[1]) / np.linalg.norm(origins[0] - before[1], axis=1)[:, None]
                    cost += price(UNCROSSED - ((target - before[0]) * lateral).sum(axis=1))
                before = target, origins[0]
        for index in self.idle:
            idle, strings[index] = self.out_of_the_way(index, touching, at, turn)
            cost += idle
        cost += self.overlap(at, turn, [(np.broadcast_to(self.palm, (n, *self.palm.shape)), 0.0)])
        for place, *_ in self.parts:
            centre = np.einsum("nji,nj->ni", turn, place - at)
            for box, frame, half in self.boxes:
                cost += price((half - np.abs((centre - box) @ frame)).min(axis=1))
        for one in range(len(self.fingers)):
            for other in range(one + 1, len(self.fingers)):
                for a, radius in strings[one]:
                    for b, wide in strings[other]:
                        gap = np.linalg.norm(a[:, :, None] - b[:, None], axis=3)
                        cost += price(radius + wide + MARGIN / 2 - gap).sum(axis=(1, 2))
        return cost

    def out_of_the_way(self, index, touching, at, turn):
        """The first posture of an idle finger that is in nothing's way, or the one that is least."""
        finger, n = self.fingers[index], len(at)
        low, high = finger.ranges.T
        beside = [other for other in touching if "thumb" not in (finger.name, self.fingers[other].name)
                  and len(self.fingers[other].dofs) == len(finger.dofs)]
        postures = []
        if beside:
            for lift in LIFTED:
                angles = touching[min(beside, key=lambda other: abs(other - index))].copy()
                angles[:, 0], angles[:, 1] = (low[0] + high[0]) / 2, np.clip(angles[:, 1] - lift, low[1], high[1])
                postures.append(angles)
        for second, others in IDLE:
            shares = np.array([0.5, second] + [others] * (len(finger.dofs) - 2))
            postures.append(np.tile(low + shares * (high - low), (n, 1)))
        best = None
        for angles in postures:
            balls = finger.forward(angles)[3]
            cost = np.zeros(n) + self.overlap(at, turn, balls)
            if best is None:
                best = cost, balls
                continue
            better = cost < best[0]
            best = np.where(better, cost, best[0]), [
                (np.where(better[:, None, None], new, old), radius) for (new, radius), (old, _) in zip(balls, best[1])]
        return best


def shell(half):
    """Points over the faces of a box."""
    counts = np.maximum(np.ceil(2 * half / PALM_APART), 1).astype(int)
    grid = np.stack(np.meshgrid(*(np.arange(count + 1) for count in counts), indexing="ij"), axis=-1).reshape(-1, 3)
    outer = ((grid == 0) | (grid == counts)).any(axis=1)
    return half * (2 * grid[outer] / counts - 1)


def main():
    given = json.load(sys.stdin)
    answers = []
    for given_problem in given["problems"]:
        problem = Problem(given["hand"], given_problem)
        looks = np.array(given_problem["looks"]) - [*problem.middle, 0, 0, 0]
        answer = {"costs": problem.cost(looks).tolist(), "friction_margin": problem.friction_margin(), "runs": []}
        for seed in range(given["seeds"]):
            problem.evaluations, start = 0, time.perf_counter()
            bounds = [(-REACH, REACH)] * 3 + [(-np.pi, np.pi)] * 3
            found = differential_evolution(lambda x: problem.cost(x.reshape(6, -1).T) if x.ndim > 1 else problem.cost(x[None])[0],
                                           bounds, rng=seed, vectorized=True, updating="deferred")
            answer["runs"].append({
                "seconds": time.perf_counter() - start, "evaluations": problem.evaluations, "cost": float(found.fun),
                "measure": float(problem.measure(found.x[None])[0]), "x": found.x.tolist()})
        answers.append(answer)
    json.dump(answers, sys.stdout)


main()
