"""Trees on servers that do as they are told."""

from __future__ import annotations

import numpy as np

from clearway.navigators.nav2.behavior_tree.actions import ThroughPath
from clearway.navigators.nav2.behavior_tree.nodes import Blackboard, Status
from clearway.navigators.nav2.behavior_tree.reader import build, parse_trees
from clearway.navigators.nav2.behavior_tree.routes import Routed
from clearway.navigators.nav2.behavior_tree.servers import Job

R, S, F = Status.RUNNING, Status.SUCCESS, Status.FAILURE


class World:
    """Servers that do as they are told: each action's answers in their order, an answer a tick; then success."""

    def __init__(self, **answers):
        self.answers = {name: list(values) for name, values in answers.items()}
        self.now, self.pose, self.velocity, self.speed = 0.0, np.zeros(3), np.zeros(3), 0.0
        self.goal_reached_tol = 0.25
        self.log, self.jobs = [], {}
        self.bad = []

    def send(self, action, request):
        self.log.append(action)
        job = self.jobs[action] = Job(request)
        return job

    def cancel(self, action):
        self.log.append(f"cancel {action}")
        self.jobs.pop(action, None)

    def clear(self, costmap, layers, reset_distance, *, around):
        self.log.append(f"clear {costmap}")
        return True

    def invalid_poses(self, request):
        self.log.append("validate")
        return self.bad

    def step(self):
        """Between two ticks: each job goes on by one answer."""
        for action, job in list(self.jobs.items()):
            if not job.running:
                continue
            answer = self.answers.get(action, [])
            answer = answer.pop(0) if answer else S
            if answer is S:
                path = np.array(
                    ((1.0, 0.0, 0.0), (8.0, 0.0, 0.0)) if action == "compute_route" else ((0.0,) * 3, (9.0, 0.0, 0.0))
                )
                given = {"compute_route": Routed(path[:, :2], path), "compute_path_through_poses": ThroughPath(path, 0)}
                job.succeed(given.get(action, path))
            elif answer is not R:
                job.abort(answer, "told to")

    def take(self):
        found, self.log = self.log, []
        return found


def tree(body, world, **board):
    trees = parse_trees(f'<root BTCPP_format="4"><BehaviorTree ID="T">{body}</BehaviorTree></root>', "T.xml")
    return rooted(trees, world, **board)


def rooted(trees, world, **board):
    blackboard = Blackboard()
    for key, value in board.items():
        blackboard.set(key, value)
    root = build(trees, blackboard, world)
    root.board = blackboard
    return root


def run(root, world, ticks, period=0.1):
    """Answers of the root and what the servers were asked, tick by tick."""
    told = []
    for _ in range(ticks):
        answer = root.execute()
        told.append((answer, world.take()))
        world.step()
        world.now += period
    return told
