"""``fric broken``: import what there is not."""

import there_is_none  # noqa: F401
