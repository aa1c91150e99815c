"""Tensor-product control: a quasi-LPV plant with friction, its vertices, and one gain for each by linear matrix inequalities.

The way from friction to a controller, one module each: :mod:`.quasi_lpv` (what is controlled), :mod:`.polytope` (its vertices),
:mod:`.inequalities` (the semidefinite programs), :mod:`.certificate` (their answer proved in exact arithmetic),
:mod:`.design` (all of it in one call), :mod:`.design_file` (``fric-tp-controller/1``) and :mod:`.law` (at run time).
"""
