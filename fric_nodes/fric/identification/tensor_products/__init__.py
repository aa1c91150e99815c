"""Parts of the tensor-product method: samples, cells, the choice of how many, and a law of effects beside them."""
