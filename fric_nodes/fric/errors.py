"""The one way in which fric refuses an input: what is wrong, where, and what to do about it.

Every room derives its own error from :class:`InputError`, so that a caller can catch one room or all of them. The command
line prints the message as it is and ends with exit status 2; a node logs it and goes on.
"""

from __future__ import annotations

__all__ = ["InputError"]


class InputError(Exception):
    """An input that cannot be used.

    Args:
        where: the file, message, option or field that is wrong, as the user knows it.
        problem: what is wrong with it, in plain words.
        remedy: what the user can do about it.
    """

    def __init__(self, where: object, problem: str, remedy: str) -> None:
        self.where = str(where)
        self.problem = problem
        self.remedy = remedy
        super().__init__(f"{self.where}: {problem}; {remedy}")

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str, str]]:
        """As another process needs it: exceptions are made anew from their arguments, of which the message is none."""
        return type(self), (self.where, self.problem, self.remedy)
