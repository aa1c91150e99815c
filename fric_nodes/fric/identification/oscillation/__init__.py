"""Free oscillations: what they are in closed form, how they are found in a recording, and what can be read off them."""
