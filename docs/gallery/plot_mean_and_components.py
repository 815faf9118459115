"""
The mean of a sample, and how it varies
=======================================

Twenty leaves, rotated, scaled and sampled at random, have a mean shape and principal components. The components are
shapes again: every point of the plane of scores is a closed curve.
"""

from curvematch_jax import Aligner
from curvematch_jax.datasets import leaves
from curvematch_jax.pictures import components_picture, mean_picture, scores_picture
from curvematch_jax.statistics import TangentPCA, karcher_mean

sample = leaves(20, seed=1, apart=0.3)  # or read_outlines("mask.png").curves, of curvematch_jax.outlines
mean = karcher_mean(sample.curves, aligner=Aligner.fast())
print(f"variance {mean.variance:.4f} square radians, converged: {mean.converged}")

mean_picture(mean.curve, mean.aligned, "mean.png")

# %%
# The first two components, from two standard deviations below the mean to two above.

components = TangentPCA.fit(mean, components=2)
print("shares of the variance:", components.explained.round(2))
rows = [components.along(0), components.along(1)]
components_picture(rows, "components.png", ["first component", "second component"], ["-2", "-1", "mean", "+1", "+2"])

# %%
# The scores of the leaves. The two groups of the sample differ in the first component.

scores_picture(components.scores(mean), "scores.png", [f"group {g}" for g in sample.groups])
