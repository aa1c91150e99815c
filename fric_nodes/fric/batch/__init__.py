"""Many recordings at once: each read and worked on by itself, every result kept, one table and one page over all of them.

A recording goes through what :mod:`fric` offers for one (``tasks/``, one file per verb). The rooms around it say which
recordings there are (:mod:`.recordings`), keep what is finished (:mod:`.journal`), hand out the work (:mod:`.pool`), make one
Parquet row per joint and recording (:mod:`.table`) and look at all axes over time (``fleet/``). :mod:`.run` puts them together.
"""
