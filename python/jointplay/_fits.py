"""The cheapest fits of several parameters that reach a yield."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence

MAX_CHOICES = 1 << 20
"""Largest number of choices that a proof visits. Visiting one without evaluating it is nearly free."""

Choice = tuple[int, ...]
"""Index of the chosen candidate of each parameter."""


class Search:
    """Branch and bound over one candidate for each parameter, `costs[i]` being those of parameter i from the loosest to the
    tightest. `reaches` tells whether a choice reaches the yield, and is called at most once for each choice and at most
    `evaluations` times.

    It assumes that a tighter fit of any parameter never lowers the yield. First the parameters are loosened one at a time as far
    as the yield allows. Then choices cheaper than the best are visited in order of cost. A choice fails if no parameter is tighter
    than in a choice known to fail. Otherwise the tightest affordable choice above it is evaluated: either that is a cheaper
    solution, or it rules out all choices below it.
    """

    def __init__(self, costs: Sequence[Sequence[float]], evaluations: int, reaches: Callable[[Choice], bool]) -> None:
        # Candidates that cost at least as much as a tighter one are never chosen.
        self._levels = [
            [(i, cost) for i, cost in enumerate(own) if all(cost < tighter for tighter in own[i + 1 :])] for own in costs
        ]
        self._reaches = reaches
        self._most = evaluations
        self._failed: list[Choice] = []
        self._best: Choice | None = None
        self.evaluations = 0
        """Number of choices that were evaluated."""
        self.is_proven = self._run()
        """Whether every cheaper choice is known to fail."""

    @property
    def best(self) -> Choice | None:
        """The cheapest choice found; None if even the tightest one fails."""
        return None if self._best is None else self.candidates(self._best)

    def candidates(self, levels: Choice) -> Choice:
        """Candidates at the given levels of cost."""
        return tuple(own[level][0] for own, level in zip(self._levels, levels, strict=True))

    def cost(self, levels: Choice) -> float:
        """Sum of the costs at these levels."""
        return sum(own[level][1] for own, level in zip(self._levels, levels, strict=True))

    def _best_cost(self) -> float:
        return float("inf") if self._best is None else self.cost(self._best)

    def _is_known_to_fail(self, choice: Choice) -> bool:
        return any(all(level <= other for level, other in zip(choice, failed)) for failed in self._failed)

    def _holds(self, choice: Choice) -> bool | None:
        """Whether a choice reaches the yield; None if no evaluation is left."""
        if self._is_known_to_fail(choice):
            return False
        if self.evaluations == self._most:
            return None
        self.evaluations += 1
        holds = self._reaches(self.candidates(choice))
        if not holds:
            self._failed = [f for f in self._failed if any(a > b for a, b in zip(f, choice))] + [choice]
        elif self.cost(choice) < self._best_cost():
            self._best = choice
        return holds

    def _run(self) -> bool:
        tightest = tuple(len(own) - 1 for own in self._levels)
        if not self._holds(tightest):
            return True
        self._loosen(tightest)
        loosest = (0,) * len(tightest)
        # Only parameters from the third entry on may still be tightened, so that each choice is visited once.
        nodes: list[tuple[float, Choice, int]] = [(self.cost(loosest), loosest, 0)]
        for _ in range(MAX_CHOICES):
            if not nodes:
                return True
            cost, choice, first = heapq.heappop(nodes)
            while cost < self._best_cost() and not self._is_known_to_fail(choice):
                above = self._tightest_affordable(choice)
                holds = self._holds(above)
                if holds is None:
                    return False
                if holds:
                    self._loosen(above)
            for i in range(first, len(choice)):
                tighter = self._tighter(choice, i)
                if tighter and self.cost(tighter) < self._best_cost():
                    heapq.heappush(nodes, (self.cost(tighter), tighter, i))
        return False

    def _tighter(self, choice: Choice, i: int) -> Choice | None:
        return (*choice[:i], choice[i] + 1, *choice[i + 1 :]) if choice[i] + 1 < len(self._levels[i]) else None

    def _loosen(self, choice: Choice) -> None:
        """Loosens a choice that reaches the yield one parameter at a time by bisection, the one with the largest saving first."""
        saving = [own[level][1] - own[0][1] for own, level in zip(self._levels, choice, strict=True)]
        for i in sorted(range(len(choice)), key=lambda i: -saving[i]):
            below, above = 0, choice[i]
            while below < above:
                middle = (below + above) // 2
                holds = self._holds((*choice[:i], middle, *choice[i + 1 :]))
                if holds is None:
                    return
                below, above = (below, middle) if holds else (middle + 1, above)
            choice = (*choice[:i], above, *choice[i + 1 :])

    def _tightest_affordable(self, choice: Choice) -> Choice:
        """Tightens a choice one level at a time, where this costs least, while it remains cheaper than the best."""
        while True:
            options = [tighter for i in range(len(choice)) if (tighter := self._tighter(choice, i))]
            cheapest = min(options, key=self.cost, default=None)
            if cheapest is None or self.cost(cheapest) >= self._best_cost():
                return choice
            choice = cheapest
