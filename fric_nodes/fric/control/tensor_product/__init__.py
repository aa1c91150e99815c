"""Tensor-product control: a quasi-LPV plant with friction, its vertices, and one gain for each by linear matrix inequalities.

The way from friction to a controller, one module each: :mod:`.quasi_lpv` (what is controlled), :mod:`.polytope` (its vertices),
:mod:`.inequalities` (the semidefinite programs), :mod:`.certificate` (their answer proved in exact arithmetic),
:mod:`.design` (all of it in one call), :mod:`.design_file` (``fric-tp-controller/1``) and :mod:`.law` (at run time). The design
needs the extra ``control`` (cvxpy), the rest doesn't::

    friction = from_model(read_model("found/model.yaml"), velocity_grid(0.5, 1000))
    plant = mass_on_friction(friction, slowest=2e-3, fastest=0.5, error=0.01)
    controller = design(polytope(plant), Requirements(decay=8.0, limit=60.0))
    print(controller.summary())
    write_tp_controller(controller, "tp.yaml")

and in a ``fric-controller/1`` file: ``controller: {type: tensor_product, design: tp.yaml, tolerance: 2.0e-5}``.
"""
