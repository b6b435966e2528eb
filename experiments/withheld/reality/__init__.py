"""What makes the benchmark's trials: vehicles, surroundings, actuators and sensors of its own.

Nothing in here imports seatruth: the physics that the trials come from shares no code with the library that
diagnoses them. Own integrator and step, own forms of wind, waves, cross-flow, steering gear and sensors; the hulls'
coefficients are the published ones, put several per cent off by whoever draws a case.
"""
